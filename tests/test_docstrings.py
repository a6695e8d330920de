"""What a user reads in an editor: each public name has a docstring in numpydoc form, and its examples run."""

import doctest
import inspect
from typing import Any, get_origin

import pytest
from numpydoc.docscrape import NumpyDocString

import hertzlink as hl
from hertzlink._names import namespaces

EVERY_CASE = ("test_examples_run",)


def public() -> dict[str, Any]:
    """Classes and functions at the top level and in its namespaces, by the name that a user types."""
    found = {}
    for name in hl.__all__:
        value = getattr(hl, name)
        if name in namespaces():
            found |= {f"{name}.{inner}": getattr(value, inner) for inner in namespaces()[name]}
        else:
            found[name] = value
    # A quantity is an annotation, not a class.
    return {name: value for name, value in found.items() if callable(value) and get_origin(value) is None}


PUBLIC = public()


@pytest.mark.parametrize("name", PUBLIC)
def test_every_parameter_is_described(name: str) -> None:
    """Parameters, and for functions what is returned; exceptions need their first lines only."""
    value = PUBLIC[name]
    text = NumpyDocString(inspect.getdoc(value) or "")
    assert text["Summary"], "no summary"
    if inspect.isclass(value) and (issubclass(value, Exception) or getattr(value, "_is_protocol", False)):
        return
    described = {one for row in text["Parameters"] for one in row.name.replace("*", "").split(", ")}
    expected = {one for one in inspect.signature(value).parameters if not one.startswith("_")}
    assert described == expected
    assert all(row.desc for row in text["Parameters"])
    if not inspect.isclass(value):
        assert text["Returns"] or text["Yields"], "what it returns is not described"


RARE = (
    "Adaptive",
    "plots.motion",
    "plots.picture",
    "plots.write_vtu",
)  # their loops are compiled for these examples alone


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.thorough] * (n in RARE)) for n in PUBLIC])
def test_examples_run(name: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each public function and class has an example that runs as it stands, after `import hertzlink as hl`."""
    value = PUBLIC[name]
    if inspect.isclass(value) and issubclass(value, Exception):
        return
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(value) or "", {"hl": hl}, name, None, 0)
    assert example.examples, "no example"
    output: list[str] = []
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    runner = doctest.DocTestRunner(optionflags=flags)
    runner.run(example, out=output.append)
    assert runner.failures == 0, "".join(output)
