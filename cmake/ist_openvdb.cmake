# OpenVDB, for .vdb files (dev setup --vdb). Its headers come without a config file; Debian ships a
# find module in a folder of its own.
set(IST_OPENVDB AUTO CACHE STRING "Read .vdb files: AUTO, ON or OFF; AUTO without OpenVDB leaves them out")
set_property(CACHE IST_OPENVDB PROPERTY STRINGS AUTO ON OFF)
find_path(IST_OPENVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(IST_OPENVDB_LIBRARY openvdb)
find_library(IST_IMATH_LIBRARY NAMES Imath Imath-3_1)  # its half floats
mark_as_advanced(IST_OPENVDB_INCLUDE_DIR IST_OPENVDB_LIBRARY IST_IMATH_LIBRARY)
set(IST_HAVE_OPENVDB OFF)
if(IST_OPENVDB)
  if(IST_OPENVDB_INCLUDE_DIR AND IST_OPENVDB_LIBRARY AND IST_IMATH_LIBRARY)
    set(IST_HAVE_OPENVDB ON)
    # As an installed ist names them, wherever they lie there.
    cmake_path(GET IST_IMATH_LIBRARY STEM imath)
    string(REGEX REPLACE "^lib" "-l" imath ${imath})
    set(IST_OPENVDB_LINK -lopenvdb ${imath})
  elseif(IST_OPENVDB STREQUAL "AUTO")
    message(STATUS "OpenVDB not found (libopenvdb-dev): .vdb files will be refused")
  else()
    message(FATAL_ERROR "IST_OPENVDB is ${IST_OPENVDB}, but OpenVDB was not found: install "
      "libopenvdb-dev (dev setup --vdb), or configure with -DIST_OPENVDB=OFF")
  endif()
endif()
# Templates of OpenVDB keep statics that those who use it have to share with it.
set(IST_OPENVDB_VISIBILITY -fvisibility=default -fno-visibility-inlines-hidden)
