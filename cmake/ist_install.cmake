# Installs the headers, the libraries, the command line, the CMake package `ist` and the pkg-config
# files. The components are Debian packages too (ist_deb.cmake): libist, libist-dev, ist, and
# libist-bullet-dev where Bullet was found.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ist)

# What a build of some targets leaves out is said before anything is installed.
set(installed ${ist_query_LIBRARIES} ${ist_LIBRARIES} ${ist_bullet_LIBRARIES})
foreach(program ist_app ist_reference)
  if(TARGET ${program})
    list(APPEND installed ${program})
  endif()
endforeach()
add_custom_target(ist_installed DEPENDS ${installed})
list(REMOVE_ITEM installed ist_reference)
list(TRANSFORM installed REPLACE "(.+)" "$<TARGET_FILE:\\1>")
install(CODE "foreach(file IN ITEMS ${installed})
  if(NOT EXISTS \"\${file}\")
    message(FATAL_ERROR \"\${file} is not built, and nothing was installed. First: \"
      \"cmake --build '${PROJECT_BINARY_DIR}' --target ist_installed\")
  endif()
endforeach()")

set(others PATTERN bullet EXCLUDE)
if(IST_QUERY_ONLY)  # headers of functions that ist::query lacks
  foreach(header IN ITEMS bake c_bake cover_spheres gpu gpu_query gpu_scene mesh query_tbb solid)
    list(APPEND others PATTERN ist/${header}.h EXCLUDE)
  endforeach()
endif()
install(DIRECTORY include/ist DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT libist-dev ${others})
# Debian wants a package's licence in a file of this name.
set(components libist libist-dev ist)
if(ist_bullet_LIBRARIES)
  list(APPEND components libist-bullet-dev)
endif()
foreach(component IN LISTS components)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${component} RENAME copyright
    COMPONENT ${component})
endforeach()
# An export set for each library and kind, so that a project that only asks needs nothing that only
# baking needs, and one that links the shared library nothing that only the static one needs.
foreach(as query ist)
  string(REPLACE ist_ist ist name ist_${as})
  foreach(library IN LISTS ${name}_LIBRARIES)
    string(REGEX REPLACE "^${name}$" static kind ${library})
    string(REPLACE ${name}_shared shared kind ${kind})
    install(TARGETS ${library} EXPORT ist-${as}-${kind}
      LIBRARY COMPONENT libist NAMELINK_COMPONENT libist-dev
      ARCHIVE COMPONENT libist-dev
      INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
    install(EXPORT ist-${as}-${kind} NAMESPACE ist:: DESTINATION ${package_dir}
      COMPONENT libist-dev)
  endforeach()
endforeach()
# The adapter links ist::query of either kind.
foreach(library IN LISTS ist_bullet_LIBRARIES)
  # CMake reads all files that begin with an export's name and a hyphen.
  string(REPLACE - _ export ${library})
  string(REPLACE ist_bullet ist-bullet export ${export})
  install(TARGETS ${library} EXPORT ${export} ARCHIVE COMPONENT libist-bullet-dev
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT ${export} NAMESPACE ist:: DESTINATION ${package_dir} COMPONENT libist-bullet-dev)
endforeach()
if(ist_bullet_LIBRARIES)
  install(DIRECTORY include/ist/bullet DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/ist
    COMPONENT libist-bullet-dev)
  install(FILES cmake/ist_find_bullet.cmake DESTINATION ${package_dir} COMPONENT libist-bullet-dev)
endif()
if(TARGET ist_app)
  install(TARGETS ist_app COMPONENT ist)
endif()
if(TARGET ist_reference)
  set(reference ${PROJECT_BINARY_DIR}/share)
  install(DIRECTORY ${reference}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ist)
  install(FILES ${reference}/bash/ist COMPONENT ist
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${reference}/fish/ist.fish COMPONENT ist
    DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
  # Below /usr zsh reads the one folder of Debian, below /usr/local the other.
  foreach(folder vendor-completions site-functions)
    install(FILES ${reference}/zsh/_ist DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${folder}
      COMPONENT ist)
  endforeach()
endif()

# A machine without the CUDA Toolkit can link the installed library: the runtime comes with it.
set(ist_cuda "")
set(cudart ${CMAKE_INSTALL_LIBDIR}/ist/libcudart_static.a)
if(IST_HAVE_CUDA)
  string(REGEX MATCH "^[0-9]+" ist_cuda ${CMAKE_CUDA_COMPILER_VERSION})
  get_target_property(cudart_here CUDA::cudart_static IMPORTED_LOCATION)
  file(REAL_PATH ${cudart_here} cudart_here)
  install(FILES ${cudart_here} DESTINATION ${CMAKE_INSTALL_LIBDIR}/ist RENAME libcudart_static.a
    COMPONENT libist-dev)
endif()

configure_package_config_file(cmake/ist-config.cmake.in ${PROJECT_BINARY_DIR}/ist-config.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS cudart)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ist-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ist-config.cmake ${PROJECT_BINARY_DIR}/ist-config-version.cmake
  DESTINATION ${package_dir} COMPONENT libist-dev)

# pkg-config. What only a static library needs is private where there is a shared one.
# ist_install_pc(name component description requires library private…)
function(ist_install_pc pc component description requires library)
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX}
    OUTPUT_VARIABLE libdir)
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_INCLUDEDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX}
    OUTPUT_VARIABLE includedir)
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
    BASE_DIRECTORY ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig OUTPUT_VARIABLE up)
  list(JOIN ARGN " " private)
  set(libs "-L\${libdir} -l${library}")
  if(TARGET ${library}_shared)
    string(APPEND libs "\nLibs.private: ${private}")
  else()
    string(APPEND libs " ${private}")
  endif()
  configure_file(cmake/ist.pc.in ${PROJECT_BINARY_DIR}/${pc}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${pc}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
    COMPONENT ${component})
endfunction()
ist_install_pc(ist-query libist-dev "Queries of inner sphere trees: overlap volume, force, distance" eigen3
  ist_query -lhwy -lstdc++ -lm)
if(NOT IST_QUERY_ONLY)
  set(private -lassimp -ltbb)
  if(IST_HAVE_CUDA)
    list(APPEND private "\${libdir}/ist/libcudart_static.a" -lpthread -ldl -lrt)
  endif()
  if(IST_HAVE_OPENVDB)
    list(APPEND private ${IST_OPENVDB_LINK})
  endif()
  ist_install_pc(ist libist-dev "Sphere packings and inner sphere trees: bakes and queries" ist-query ist
    ${private} -lstdc++ -lm)
endif()
foreach(library IN LISTS ist_bullet_LIBRARIES)
  string(REPLACE ist_ "" bullet ${library})
  ist_install_pc(ist-${bullet} libist-bullet-dev "Assets of ist as shapes of Bullet"
    "ist-query ${bullet}" ${library})
endforeach()
