# Installs the headers, the libraries, the command line and the CMake package `ist`.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ist)

install(DIRECTORY include/ist DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
# Two export sets, so that a project that only asks needs nothing that only baking needs.
install(TARGETS ist_query EXPORT ist-query-targets
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT ist-query-targets NAMESPACE ist:: DESTINATION ${package_dir})
if(TARGET ist)
  install(TARGETS ist EXPORT ist-targets)
  install(EXPORT ist-targets NAMESPACE ist:: DESTINATION ${package_dir})
endif()
if(TARGET ist_app)
  install(TARGETS ist_app)
endif()

# A machine without the CUDA Toolkit can link the installed library: the runtime comes with it.
set(ist_cuda "")
set(cudart ${CMAKE_INSTALL_LIBDIR}/ist/libcudart_static.a)
if(IST_HAVE_CUDA)
  set(ist_cuda ${CUDAToolkit_VERSION_MAJOR})
  file(REAL_PATH ${CUDA_cudart_static_LIBRARY} cudart_here)
  install(FILES ${cudart_here} DESTINATION ${CMAKE_INSTALL_LIBDIR}/ist RENAME libcudart_static.a)
endif()

configure_package_config_file(cmake/ist-config.cmake.in ${PROJECT_BINARY_DIR}/ist-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS cudart)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ist-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ist-config.cmake ${PROJECT_BINARY_DIR}/ist-config-version.cmake
  DESTINATION ${package_dir})
