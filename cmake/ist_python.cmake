# IST_PYTHON AUTO|ON|OFF: the Python module (python/). Sets IST_HAVE_PYTHON. AUTO leaves it out where
# nanobind, or what CPython's extensions need, is missing; ON ends with an error there. nanobind is
# that of the interpreter, or what ./dev setup brings.
#
# A cross compiler is asked by ON alone, and takes the headers of the interpreter that runs here: what
# they say is the same on every 64-bit Linux.
#
# Debian's interpreter need not be the first in PATH; name another one by -DPython_EXECUTABLE.
set(IST_HAVE_PYTHON FALSE)
if(IST_PYTHON STREQUAL "OFF" OR IST_SANITIZE STREQUAL "thread" OR IST_FUZZ
    OR (CMAKE_CROSSCOMPILING AND NOT IST_PYTHON STREQUAL "ON"))
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
  # By the stable ABI, which has enough from 3.12 on, one module is for all later versions. CMake
  # knows that target from 3.26 on; but for Windows it is no other.
  if(NOT TARGET Python::SABIModule)
    add_library(Python::SABIModule INTERFACE IMPORTED)
    target_link_libraries(Python::SABIModule INTERFACE Python::Module)
  endif()
  execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir
    OUTPUT_VARIABLE nanobind_hint OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  find_package(nanobind 2.10 ${found_how} CONFIG
    HINTS ${nanobind_hint} ${PROJECT_SOURCE_DIR}/build-python-tools/nanobind/cmake)
endif()
if(Python_FOUND AND nanobind_FOUND)
  set(IST_HAVE_PYTHON TRUE)
else()
  message(STATUS "ist: no Python module: nanobind or python3-dev is missing (./dev setup)")
endif()

# ist_add_python_module(name sources…)
function(ist_add_python_module name)
  nanobind_add_module(${name} STABLE_ABI NB_STATIC NOMINSIZE NOSTRIP NB_SUPPRESS_WARNINGS ${ARGN})
endfunction()
