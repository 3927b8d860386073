# Libraries that ist is measured and checked against: FCL and Bullet's double-precision build
# (tests/oracle, benchmarks). Each is optional; a missing one is named when CMake runs.
#   ist_peer_fcl, ist_peer_coal, ist_peer_bullet, ist_peer_manifold, ist_peer_cgal: interface targets, there only
#   when the library was found.
include_guard(GLOBAL)

find_package(fcl QUIET)
if(fcl_FOUND)
  add_library(ist_peer_fcl INTERFACE)
  target_include_directories(ist_peer_fcl SYSTEM INTERFACE ${FCL_INCLUDE_DIRS})
  target_link_libraries(ist_peer_fcl INTERFACE fcl ccd Eigen3::Eigen)
else()
  message(STATUS "FCL not found (libfcl-dev): no comparison with it")
endif()

# `./dev setup --bench` installs it there.
set(coal_prefix ${PROJECT_SOURCE_DIR}/build-coal/cmeel.prefix)
if(EXISTS ${coal_prefix}/lib/libcoal.so)
  add_library(ist_peer_coal INTERFACE)
  target_include_directories(ist_peer_coal SYSTEM INTERFACE ${coal_prefix}/include)
  target_link_libraries(ist_peer_coal INTERFACE ${coal_prefix}/lib/libcoal.so
    ${coal_prefix}/lib/libboost_serialization.so Eigen3::Eigen)
  target_link_options(ist_peer_coal INTERFACE -Wl,-rpath,${coal_prefix}/lib
    -Wl,-rpath-link,${coal_prefix}/lib)
else()
  message(STATUS "Coal not found (./dev setup --bench): no comparison with it")
endif()

include(${CMAKE_CURRENT_LIST_DIR}/ist_find_bullet.cmake)
ist_find_bullet(-float64)
if(TARGET ist_bullet_library-float64)
  add_library(ist_peer_bullet INTERFACE)
  target_link_libraries(ist_peer_bullet INTERFACE ist_bullet_library-float64)
else()
  message(STATUS "Bullet in double precision not found (libbullet-dev): no comparison with it")
endif()

# `./dev setup --bench` builds it there.
find_package(manifold QUIET NO_DEFAULT_PATH PATHS ${PROJECT_SOURCE_DIR}/build-manifold/install)
if(TARGET manifold::manifold)
  add_library(ist_peer_manifold INTERFACE)
  target_link_libraries(ist_peer_manifold INTERFACE manifold::manifold)
else()
  message(STATUS "Manifold not found (./dev setup --bench): no comparison with it")
endif()

find_path(IST_CGAL_INCLUDE_DIR CGAL/Surface_mesh.h)
find_library(IST_GMP gmp)
find_library(IST_MPFR mpfr)
mark_as_advanced(IST_CGAL_INCLUDE_DIR IST_GMP IST_MPFR)
if(IST_CGAL_INCLUDE_DIR AND IST_GMP AND IST_MPFR)
  add_library(ist_peer_cgal INTERFACE)
  target_include_directories(ist_peer_cgal SYSTEM INTERFACE ${IST_CGAL_INCLUDE_DIR})
  target_link_libraries(ist_peer_cgal INTERFACE ${IST_MPFR} ${IST_GMP})
else()
  message(STATUS "CGAL not found (libcgal-dev): no comparison with it")
endif()
