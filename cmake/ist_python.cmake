# IST_PYTHON AUTO|ON|OFF: the Python module (python/). Sets IST_HAVE_PYTHON. AUTO leaves it out where
# pybind11, or what CPython's extensions need, is missing; ON ends with an error there.
#
# Debian's packages are for Debian's interpreter, which need not be the first in PATH; name another
# one by -DPython_EXECUTABLE.
set(IST_HAVE_PYTHON FALSE)
if(IST_PYTHON STREQUAL "OFF" OR IST_SANITIZE STREQUAL "thread" OR IST_FUZZ OR CMAKE_CROSSCOMPILING)
  return()
endif()
if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
set(found_how QUIET)
if(IST_PYTHON STREQUAL "ON")
  set(found_how REQUIRED)
endif()
find_package(Python 3.9 ${found_how} COMPONENTS Interpreter Development.Module)
if(Python_FOUND)
  find_package(pybind11 2.10 ${found_how} CONFIG)
endif()
if(Python_FOUND AND pybind11_FOUND)
  set(IST_HAVE_PYTHON TRUE)
else()
  message(STATUS "ist: no Python module: pybind11-dev or python3-dev is missing")
endif()
