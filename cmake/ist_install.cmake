# Installs the headers, both libraries, the command line and the CMake package `ist`.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ist)

install(DIRECTORY include/ist DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS ist_query EXPORT ist-query-targets)
install(TARGETS ist EXPORT ist-targets)
if(TARGET ist_app)
  install(TARGETS ist_app)
endif()
# Two export sets, so that a project that only asks needs nothing that only baking needs.
foreach(set ist-query-targets ist-targets)
  install(EXPORT ${set} NAMESPACE ist:: DESTINATION ${package_dir})
endforeach()

configure_package_config_file(cmake/ist-config.cmake.in ${PROJECT_BINARY_DIR}/ist-config.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ist-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ist-config.cmake ${PROJECT_BINARY_DIR}/ist-config-version.cmake
  DESTINATION ${package_dir})
