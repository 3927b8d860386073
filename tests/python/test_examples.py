"""What users copy from runs."""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import pytest

import ist

EXAMPLES = pathlib.Path(os.environ.get("IST_EXAMPLES", pathlib.Path(__file__).parents[2] / "examples/python"))


ROOT = EXAMPLES.parents[1]


def lines_of(page):
    """The first lines of Python in a page."""
    return re.search(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)[1]


def run(name, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], check=True,
                          capture_output=True, text=True, timeout=600).stdout


def test_the_readmes_lines():
    out = subprocess.run([sys.executable, "-c", lines_of("README.md")], check=True, capture_output=True,
                         text=True).stdout
    assert float(out.split()[0]) > 0.5


def test_the_first_lines_of_the_guide():
    exec(lines_of("docs/python.md"), {})


def test_many_bodies_of_the_guide():
    names = {}
    exec(lines_of("docs/python.md"), names)
    text = (ROOT / "docs/python.md").read_text()
    exec(next(block for block in re.findall(r"```python\n(.*?)```", text, re.S) if "ist.Scene()" in block),
         names)
    assert len(names["scene"]) == 4 and len(names["step"].ended) + len(names["step"]) > 0


@pytest.mark.parametrize("number", range(3))
def test_twenty_lines_of_each_trade(number):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs/trades.md").read_text(), re.S)
    assert len(blocks) == 3
    exec(blocks[number], {})


def test_the_tour():
    assert "it lands at 0.7" in run("tour.py")


def test_parts_find_room_in_a_box(tmp_path):
    picture = []
    if importlib.util.find_spec("matplotlib") is not None:  # ./dev setup --bench
        picture = ["--picture", tmp_path / "box.png"]
    assert "4 of 4 parts found room" in run("packing.py", "--parts", 4, *picture)
    assert not picture or picture[1].stat().st_size > 10_000


def test_a_heap_is_pushed_apart():
    pytest.importorskip("torch", reason="no python3-torch: ./dev setup --torch")
    assert "0 u³ left" in run("pile.py", "--objects", 12)
