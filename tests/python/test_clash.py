"""All pairs of an assembly from Python."""
import pathlib
import subprocess

import numpy as np
import pytest

import ist

CUBE = ist.sample_mesh("cube")
EDGE = float(np.ptp(CUBE.vertices[:, 0]))


def at(x):
    return [1, 0, 0, 0, x * EDGE, 0, 0]


def test_pairs_and_their_numbers():
    asset = ist.bake_mesh_only(CUBE)
    report = ist.clash([CUBE, asset, (CUBE.vertices, CUBE.triangles)], [at(0), at(0.75), at(1.75)],
                       names=["a", "b", "c"], tolerance=0.1)
    assert report["schema"] == "ist.clash/1" and report["parts"] == 3 and report["faults"] == []
    over, touch = report["pairs"]
    assert (over["a"], over["b"], over["kind"]) == ("a", "b", "overlapping")
    assert over["volume"] == pytest.approx(0.25 * EDGE**3)
    assert over["verdict"] == "certainly above"
    assert (touch["a"], touch["b"], touch["kind"]) == ("b", "c", "touching")
    assert touch["contact_area"] == pytest.approx(EDGE**2)


def test_it_is_what_the_command_line_says(tmp_path):
    path = tmp_path / "cube.off"
    path.write_text("OFF\n%d %d 0\n" % (len(CUBE.vertices), len(CUBE.triangles))
                    + "".join("%r %r %r\n" % tuple(map(float, v)) for v in CUBE.vertices)
                    + "".join("3 %d %d %d\n" % tuple(t) for t in CUBE.triangles))
    poses = [[1, 0, 0, 0, 0, 0, 0], [0.9, 0.1, 0.2, 0.3, 0.3, 0.2, 0.1]]
    (tmp_path / "two.toml").write_text("".join(
        f"[[part]]\nname = '{i}'\nmesh = 'cube.off'\npose = {pose}\n"
        for i, pose in enumerate(poses)))
    program = pathlib.Path(ist.__file__).parents[2] / "bin" / "ist"
    if not program.exists():
        pytest.skip("no command line beside the package")
    import json
    told = json.loads(subprocess.run([program, "clash", tmp_path / "two.toml", "--json"],
                                     capture_output=True, text=True).stdout)
    assert ist.clash([path, path], poses) == told


def test_faults_floats_and_mistakes():
    open_mesh = ist.Mesh(CUBE.vertices, CUBE.triangles[1:])
    report = ist.clash([open_mesh, CUBE])
    assert [fault["part"] for fault in report["faults"]] == ["0"] and report["pairs"] == []
    # Arrays of float32 touch where float64 overlap.
    for dtype, kind in ((np.float32, "touching"), (np.float64, "overlapping")):
        mesh = (CUBE.vertices.astype(dtype), CUBE.triangles)
        assert ist.clash([mesh, mesh], [at(0), at(1 - 1e-8)])["pairs"][0]["kind"] == kind
    assert ist.clash([CUBE, CUBE], [at(0), at(1.1)]) ["pairs"] == []
    near = ist.clash([CUBE, CUBE], [at(0), at(1.1)], clearance=EDGE)["pairs"][0]
    assert near["kind"] == "apart" and near["distance_max"] == pytest.approx(0.1 * EDGE)
    assert ist.clash([CUBE, CUBE], [at(0), at(0.9)], touch_within=EDGE)["pairs"][0]["kind"] == "touching"
    assert ist.clash([], [])["pairs"] == []
    for wrong in ({"poses": [at(0)]}, {"names": ["a"]}, {"scales": [1, 0]}, {"clearance": -1},
                  {"poses": [at(np.nan), at(0)]}):
        with pytest.raises((ValueError, ist.Error)):
            ist.clash([CUBE, CUBE], **wrong)
    with pytest.raises(TypeError, match="meshes: a dict; wanted a list"):
        ist.clash({"a": CUBE, "b": CUBE})
    with pytest.raises(ValueError, match=r"names\[1\]: 'a' is given twice"):
        ist.clash([CUBE, CUBE], names=["a", "a"])
    with pytest.raises(ValueError, match=r"poses\[1\]: tx is nan"):
        ist.clash([CUBE, CUBE], [at(0), at(np.nan)])
    with pytest.raises(ist.Error, match="reaches beyond 1e37 u"):
        ist.clash([CUBE, CUBE], [[1, 0, 0, 0, 1e38, 0, 0]] * 2)
