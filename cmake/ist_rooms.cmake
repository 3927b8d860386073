# A room is a folder of the source tree, compiled as an object library that sees only the rooms it
# may use: each has an include root of its own in the build tree, a link to its folder, so that
# "mesh/mesh_solid.h" is found by those alone whose list of USES leads to the room `mesh`.
# tests/house checks the finer drawing of docs/design.md, folder by folder.

set(IST_ROOMS_DIR ${PROJECT_BINARY_DIR}/rooms)

# What every room sees: the public headers and Eigen.
add_library(ist_public INTERFACE)
target_include_directories(ist_public INTERFACE ${PROJECT_SOURCE_DIR}/include)
target_compile_features(ist_public INTERFACE cxx_std_20)
target_link_libraries(ist_public INTERFACE Eigen3::Eigen)

# What tests, benchmarks and the command line see: the headers of all rooms.
add_library(ist_internal INTERFACE)

# ist_compile_together(target sources…): nine sources are one for the compiler, since half of its time
# goes to headers and templates that all of them use. On two cores all of a target's are one: that takes
# a quarter less again, and there is nobody to share them out to. Sources that are compiled once an
# instruction set stay alone; so do all where tools read how each is compiled, or a missing include is
# looked for.
cmake_host_system_information(RESULT ist_cores QUERY NUMBER_OF_LOGICAL_CORES)
function(ist_compile_together target)
  if(CMAKE_DISABLE_PRECOMPILE_HEADERS OR CMAKE_EXPORT_COMPILE_COMMANDS)
    return()
  endif()
  set(sources 9)
  if(ist_cores LESS_EQUAL 2)
    set(sources 0)  # no limit
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${sources})
  foreach(source IN LISTS ARGN)
    file(STRINGS ${source} each_target REGEX "hwy/foreach_target" LIMIT_COUNT 1)
    if(each_target)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()

# ist_add_room(name [APART] FOLDER path AS prefix USES rooms… LIBS targets… SOURCES files…)
#   AS: what its headers are included by ("mesh" for "mesh/weld.h").
#   LIBS: third parties that its headers or sources need.
#   APART: no part of the library ist::ist.
#   SOURCES: relative to FOLDER; none for a room of headers alone.
function(ist_add_room name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "APART" "FOLDER;AS" "USES;LIBS;SOURCES")
  set(target ist_room_${name})
  set(root ${IST_ROOMS_DIR}/${name})
  target_include_directories(ist_internal INTERFACE ${root})
  cmake_path(GET arg_AS PARENT_PATH parent)
  file(MAKE_DIRECTORY ${root}/${parent})
  if(NOT EXISTS ${root}/${arg_AS})
    file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${arg_FOLDER} ${root}/${arg_AS} SYMBOLIC)
  endif()
  list(TRANSFORM arg_USES PREPEND ist_room_)
  if(arg_SOURCES)
    list(TRANSFORM arg_SOURCES PREPEND ${PROJECT_SOURCE_DIR}/${arg_FOLDER}/)
    add_library(${target} OBJECT ${arg_SOURCES})
    target_include_directories(${target} PUBLIC ${root})
    target_link_libraries(${target} PUBLIC ist_public ${arg_USES} PRIVATE ${arg_LIBS})
    ist_compile_options(${target})
    ist_compile_together(${target} ${arg_SOURCES})
    if(NOT arg_APART)
      set_property(GLOBAL APPEND PROPERTY IST_ROOM_OBJECTS $<TARGET_OBJECTS:${target}>)
    endif()
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE ${root})
    target_link_libraries(${target} INTERFACE ist_public ${arg_USES})
  endif()
endfunction()
