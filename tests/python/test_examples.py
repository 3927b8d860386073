"""What users copy from runs."""
import importlib.util
import os
import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(os.environ.get("IST_EXAMPLES", pathlib.Path(__file__).parents[2] / "examples/python"))


def run(name, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], check=True,
                          capture_output=True, text=True, timeout=600).stdout


def test_the_tour():
    assert "it lands at 0.7" in run("tour.py")


def test_parts_find_room_in_a_box():
    assert "6 of 6 parts found room" in run("packing.py", "--parts", 6)


def test_a_heap_is_pushed_apart():
    pytest.importorskip("torch", reason="no python3-torch: ./dev setup --torch")
    assert "0 u³ left" in run("pile.py", "--objects", 12)


@pytest.mark.skipif(importlib.util.find_spec("matplotlib") is None,
                    reason="no python3-matplotlib: ./dev setup --bench")
def test_pictures_are_drawn(tmp_path):
    run("packing.py", "--parts", 2, "--picture", tmp_path / "box.png")
    assert (tmp_path / "box.png").stat().st_size > 10_000
