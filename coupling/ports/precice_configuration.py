"""A configuration of preCICE for a chain and a structure, by the rules of docs/interoperability.md."""

from coupling.ports.guest import guest_chain
from coupling.ports.precice import DEFAULT_NAMES, STEPS_PER_CONTACT, STRUCTURE_NAMES
from particles.chain import Chain
from structures.checks import positive
from structures.surface import Surface

STILL, WEAK, RELATIVE = 2e-14, 1e-9, 1e-9
"""Limits of convergence: of the displacement (m) and of the force (N), and their relative limit. preCICE refuses
absolute limits of 1e-14 and less."""

CONFIGURATION = """<?xml version="1.0" encoding="UTF-8" ?>
<precice-configuration>
  <log>
    <sink type="stream" output="stdout" filter="%Severity% > info" enabled="true" />
  </log>

  <data:scalar name="{force}" waveform-degree="0" />
  <data:scalar name="{displacement}" waveform-degree="1" />

  <mesh name="{chain_mesh}" dimensions="3">
    <use-data name="{force}" />
    <use-data name="{displacement}" />
  </mesh>
  <mesh name="{structure_mesh}" dimensions="3">
    <use-data name="{force}" />
    <use-data name="{displacement}" />
  </mesh>

  <participant name="{chain}">
    <provide-mesh name="{chain_mesh}" />
    <receive-mesh name="{structure_mesh}" from="{structure}" />
    <write-data name="{force}" mesh="{chain_mesh}" />
    <read-data name="{displacement}" mesh="{chain_mesh}" />
    <mapping:nearest-neighbor direction="write" from="{chain_mesh}" to="{structure_mesh}" constraint="conservative" />
    <mapping:nearest-neighbor direction="read" from="{structure_mesh}" to="{chain_mesh}" constraint="consistent" />
  </participant>
  <participant name="{structure}">
    <provide-mesh name="{structure_mesh}" />
    <write-data name="{displacement}" mesh="{structure_mesh}" />
    <read-data name="{force}" mesh="{structure_mesh}" />
  </participant>

  <m2n:sockets acceptor="{chain}" connector="{structure}" exchange-directory="." />

  <coupling-scheme:serial-implicit>
    <participants first="{structure}" second="{chain}" />
    <max-time value="{until!r}" />
    <time-window-size value="{window!r}" />
    <max-iterations value="50" />
    <exchange data="{displacement}" mesh="{structure_mesh}" from="{structure}" to="{chain}" />
    <exchange data="{force}" mesh="{structure_mesh}" from="{chain}" to="{structure}" substeps="false" />
    <absolute-or-relative-convergence-measure
      data="{displacement}" mesh="{structure_mesh}" abs-limit="{STILL}" rel-limit="{RELATIVE}" />
    <absolute-or-relative-convergence-measure
      data="{force}" mesh="{structure_mesh}" abs-limit="{WEAK}" rel-limit="{RELATIVE}" />
    <acceleration:aitken>
      <data name="{force}" mesh="{structure_mesh}" />
      <initial-relaxation value="0.5" />
    </acceleration:aitken>
  </coupling-scheme:serial-implicit>
</precice-configuration>
"""


def precice_configuration(
    chain: Chain, surface: Surface, until: float, flexibility: float = 0.0, window: float | None = None
) -> str:
    """Return the text of a configuration of preCICE 3 for a chain on a surface.

    Parameters
    ----------
    chain : Chain
        The chain.
    surface : Surface
        The surface that it touches.
    until : float
        Length of the record, s.
    flexibility : float
        Compliance in series with the contact, m/N.
    window : float, optional
        Length of preCICE's windows, s; by default 1/64 of a contact.

    Returns
    -------
    str
        The text of an XML file: participants "Chain" and "Structure", serial-implicit, with Aitken's relaxation.

    Raises
    ------
    ValueError
        For bad input.

    Examples
    --------
    >>> import hertzlink as hl
    >>> from coupling.ports.precice_configuration import precice_configuration
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> text = precice_configuration(hl.Chain([bead] * 20, bead, 0.31), hl.Surface(hl.ACRYLIC), until=1e-3)
    >>> '<max-time value="0.001" />' in text
    True
    """
    usual = guest_chain(chain, surface, flexibility).contact_time / STEPS_PER_CONTACT
    return CONFIGURATION.format(
        chain=DEFAULT_NAMES["participant"], chain_mesh=DEFAULT_NAMES["mesh"],
        structure=STRUCTURE_NAMES["participant"], structure_mesh=STRUCTURE_NAMES["mesh"],
        force=DEFAULT_NAMES["force"], displacement=DEFAULT_NAMES["displacement"], STILL=STILL, WEAK=WEAK,
        RELATIVE=RELATIVE, until=positive("until", until, "s"),
        window=usual if window is None else positive("window", window, "s"),
    )  # fmt: skip
