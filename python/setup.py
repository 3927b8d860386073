"""Builds the module by CMake, in a tree of its own or, with IST_BUILD=DIR, in one that is there."""
import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent


def version():
    text = (ROOT / "include/ist/version.h").read_text()
    return ".".join(re.findall(r"^#define IST_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", text, re.M))


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        tree = os.environ.get("IST_BUILD")
        if not tree:
            tree = str(pathlib.Path(self.build_temp).resolve())
            subprocess.run(["cmake", "-S", ROOT, "-B", tree, "-DCMAKE_BUILD_TYPE=Release",
                            "-DIST_BUILD_TESTS=OFF", "-DIST_PYTHON=ON",
                            f"-DPython_EXECUTABLE={sys.executable}",
                            *os.environ.get("CMAKE_ARGS", "").split()], check=True)
        subprocess.run(["cmake", "--build", tree, "--target", "ist_python", "--parallel",
                        str(os.cpu_count())], check=True)
        built = pathlib.Path(tree) / "python/ist" / pathlib.Path(
            self.get_ext_filename("_core")).name
        self.copy_file(str(built), self.get_ext_fullpath(extension.name))


# Reads the package's files beside this one, wherever pip was called.
os.chdir(HERE)
setup(version=version(), ext_modules=[Extension("ist._core", [])],
      cmdclass={"build_ext": CMakeBuild})
