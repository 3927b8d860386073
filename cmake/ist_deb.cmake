# `cpack` in the build folder makes three Debian packages: libist (the shared libraries), libist-dev
# (headers, static libraries, CMake package, pkg-config files) and ist (the program, which needs
# neither). What they depend on is read from the binaries (dpkg-shlibdeps).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ist)
set(CPACK_PACKAGE_VENDOR ist)
set(CPACK_PACKAGE_CONTACT "the authors of ist <ist@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL libist libist-dev ist)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})

set(CPACK_DEBIAN_LIBIST_PACKAGE_NAME libist)
set(CPACK_DEBIAN_LIBIST_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBIST_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBIST_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBIST_DESCRIPTION "${PROJECT_DESCRIPTION}: shared libraries")

set(CPACK_DEBIAN_LIBIST-DEV_PACKAGE_NAME libist-dev)
set(CPACK_DEBIAN_LIBIST-DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBIST-DEV_PACKAGE_DEPENDS
  "libist (= ${PROJECT_VERSION}), libeigen3-dev, libhwy-dev, libassimp-dev, libtbb-dev")
if(IST_HAVE_OPENVDB)
  string(APPEND CPACK_DEBIAN_LIBIST-DEV_PACKAGE_DEPENDS ", libopenvdb-dev")
endif()
set(CPACK_DEBIAN_LIBIST-DEV_DESCRIPTION "${PROJECT_DESCRIPTION}: for development")

set(CPACK_DEBIAN_IST_PACKAGE_NAME ist)
set(CPACK_DEBIAN_IST_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_IST_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_IST_DESCRIPTION "${PROJECT_DESCRIPTION}: the command line")
include(CPack)
