"""`hertzlink explore`: a case with sliders, in the browser."""

import os
import threading
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hertzlink.cli import of_case
from hertzlink.output import say

if TYPE_CHECKING:
    from hertzlink.cases.case import Case


@click.command("explore", short_help="Open a page with sliders for a case, in the browser.")
@of_case
@click.option(
    "--port", metavar="NUMBER", type=click.IntRange(0, 65535), default=0,
    help="Port of the page; by default a free one.",
)  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Print the address of the page, and open no browser.")
def explore_case(name: str, case: "Case", port: int, no_browser: bool) -> None:
    """Open a page with sliders for a case, in the browser.

    It shows at once how the force at a sensor, the amplitude ratio (AR) and the time of flight (TOF) of the reflected
    waves change. The sliders are the axes of [sweep], or else the usual parameters of the structure; the impact speed;
    and the sensor. Only this computer can open the page. Ctrl-C ends it.
    """
    from hertzlink.cases.tasks import task_of
    from hertzlink.explore.answers import Explorer, modes_for
    from hertzlink.explore.server import Server
    from hertzlink.explore.sliders import sliders_of, start_of

    task = task_of(case)
    start = start_of(task)
    start.simulation()  # refuses what is wrong; sliders are made of what is right
    explorer, notes = Explorer(start, sliders_of(task, start)), list[str]()
    # The first answer also loads compiled code, and finds what is wrong before any page opens.
    own = explorer.answer({})["waves"]["primary"].get("amplitude_ratio")
    explorer.modes = modes_for(start, explorer.sliders)
    if explorer.modes is not None:
        say("preparing the plate for all values of its sliders: some seconds, once ...")
        notes = ["All plates come from one set of modes."]
        of_modes = explorer.answer({})["waves"]["primary"].get("amplitude_ratio")
        if own is not None and of_modes is not None:
            notes[0] += f" At the first values AR differs by {abs(of_modes - own):.1e} from that of `hertzlink run`."
        say(notes[0])
    try:
        server = Server(explorer, case.title or Path(name).stem, notes, port)
    except OSError as error:
        raise ValueError(f"--port {port}: cannot be used ({error.strerror}); give another, or none") from error
    with server:
        say(f"open {server.address}\nCtrl-C ends it")
        if not no_browser:
            # In a thread: a browser may wait for the page.
            threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            try:
                explorer.close()
            except KeyboardInterrupt:  # a user who does not want to wait for the running answer
                os._exit(130)
            say("ended")
