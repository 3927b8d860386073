"""What a user does with an installed wheel, in an environment of nothing but NumPy."""
import multiprocessing
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = pathlib.Path(sys.executable).parent / "ist"


def lines_of_readme():
    """The first Python of README.md."""
    text = (HERE.parent.parent / "README.md").read_text()
    return text.partition("```python\n")[2].partition("```")[0]


def volume(asset):
    import ist
    return ist.penetration(asset, asset, [1, 0, 0, 0, 0.1, 0, 0]).volume


def main():
    begin = time.process_time()  # what else runs on the machine does not count
    import ist
    spent = time.process_time() - begin
    print(f"ist {ist.__version__}, import {1e3 * spent:.0f} ms")
    assert spent < 0.3
    os.chdir(tempfile.mkdtemp())
    told = subprocess.run([PROGRAM, "--version"], check=True, capture_output=True, text=True).stdout
    assert told == f"ist {ist.__version__}\n", told
    subprocess.run([PROGRAM, "sample", "bolt", "-o", "bolt.obj"], check=True)
    subprocess.run([sys.executable, "-c", lines_of_readme()], check=True)
    bolt = ist.bake("bolt.obj", max_spheres=100)
    assert pickle.loads(pickle.dumps(bolt)).to_bytes() == bolt.to_bytes()
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert set(pool.map(volume, [bolt] * 4)) == {volume(bolt)}
    assert not ist.gpu.available() and ist.gpu.why_not()
    folder = pathlib.Path(ist.__file__).parent
    assert "WebGL" in str(ist.plot(bolt))
    assert {"py.typed", "__init__.pyi", "torch.py"} <= set(os.listdir(folder))
    print("ok")


if __name__ == "__main__":
    main()
