# ist::ist is all of it: import, solid, packing, calibration, trees, assets, queries.
find_package(assimp QUIET)
find_path(NLOHMANN_JSON_INCLUDE_DIR nlohmann/json.hpp)  # header only
find_path(IST_BOOST_INCLUDE_DIR boost/multiprecision/cpp_int.hpp)  # header only
if(NOT assimp_FOUND OR NOT TBB_FOUND OR NOT NLOHMANN_JSON_INCLUDE_DIR OR NOT IST_BOOST_INCLUDE_DIR)
  message(FATAL_ERROR "ist: baking needs assimp (found: ${assimp_FOUND}), oneTBB (${TBB_FOUND}), "
    "nlohmann-json (${NLOHMANN_JSON_INCLUDE_DIR}) and Boost's headers (${IST_BOOST_INCLUDE_DIR}): "
    "install them, or configure with -DIST_QUERY_ONLY=ON to build ist::query, which needs none of "
    "them")
endif()
include(cmake/ist_cuda.cmake)
include(cmake/ist_openvdb.cmake)

add_subdirectory(src)
add_subdirectory(ist/bake)
get_property(core GLOBAL PROPERTY IST_ROOM_OBJECTS)
if(PROJECT_IS_TOP_LEVEL OR IST_ROBOTS)
  add_subdirectory(ist/robots)
endif()

get_property(objects GLOBAL PROPERTY IST_ROOM_OBJECTS)
ist_add_library(ist ist ${objects})
# What tests without robots link: a build of theirs alone leaves the robots out.
add_library(ist_core STATIC EXCLUDE_FROM_ALL ${core})
set_target_properties(ist_core PROPERTIES LINKER_LANGUAGE CXX)
foreach(library IN LISTS ist_LIBRARIES ITEMS ist_core)
  set(query ist_query)
  if(library STREQUAL "ist_shared" OR NOT TARGET ist_query)
    set(query ist_query_shared)
  endif()
  target_link_libraries(${library} PUBLIC ${query} PRIVATE assimp::assimp TBB::tbb hwy::hwy)
  if(IST_HAVE_CUDA)
    target_link_libraries(${library} PRIVATE CUDA::cudart_static)
  endif()
  if(IST_HAVE_OPENVDB)
    target_link_libraries(${library} PRIVATE
      $<BUILD_INTERFACE:${IST_OPENVDB_LIBRARY}> $<BUILD_INTERFACE:${IST_IMATH_LIBRARY}>)
    foreach(flag IN LISTS IST_OPENVDB_LINK)
      target_link_libraries(${library} PRIVATE $<INSTALL_INTERFACE:${flag}>)
    endforeach()
  endif()
endforeach()
if(TARGET ist_shared)
  # The hash of an asset and the parts of balls inside surfaces, which baking needs too, are nobody's
  # to see: both libraries hold them.
  target_sources(ist_shared PRIVATE
    $<FILTER:$<TARGET_OBJECTS:ist_room_query>,INCLUDE,content_hash|patch_sums|surface_patch>)
endif()
if(PROJECT_IS_TOP_LEVEL)
  add_subdirectory(ist/app)
endif()
