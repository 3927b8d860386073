# Bullet, which Debian installs in both precisions side by side: the headers follow
# BT_USE_DOUBLE_PRECISION, the libraries of double precision carry the suffix -float64. Linking the
# others compiles and then reads garbage.
#
# ist_find_bullet(suffix) makes the interface target ist_bullet_library<suffix>, or none where a part
# is missing. `suffix`: "" for single precision or -float64.
include_guard(GLOBAL)
function(ist_find_bullet suffix)
  set(target ist_bullet_library${suffix})
  string(MAKE_C_IDENTIFIER "${suffix}" kind)
  find_path(IST_BULLET_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet)
  set(libraries)
  foreach(library IN ITEMS BulletDynamics BulletCollision LinearMath)
    find_library(IST_${library}${kind} ${library}${suffix})
    mark_as_advanced(IST_${library}${kind})
    list(APPEND libraries ${IST_${library}${kind}})
  endforeach()
  mark_as_advanced(IST_BULLET_INCLUDE_DIR)
  if(TARGET ${target} OR NOT IST_BULLET_INCLUDE_DIR OR "${libraries}" MATCHES "NOTFOUND")
    return()
  endif()
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES ${IST_BULLET_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES "${libraries}")
  if(suffix STREQUAL "-float64")
    set_target_properties(${target} PROPERTIES
      INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION)
  endif()
endfunction()
