# The two libraries, static and shared of the same objects. A project that contains this one gets the
# kind that its BUILD_SHARED_LIBS asks for; for ourselves both are made, and both are installed.
set(IST_LIBRARY_KINDS static shared)
if(NOT PROJECT_IS_TOP_LEVEL)
  if(BUILD_SHARED_LIBS)
    set(IST_LIBRARY_KINDS shared)
  else()
    set(IST_LIBRARY_KINDS static)
  endif()
endif()

# ist_add_library(name as objects…)
# Makes `name` (static) and `name`_shared, lists what it made in `name`_LIBRARIES, and lets ist::`as`
# stand for the kind that BUILD_SHARED_LIBS asks for.
function(ist_add_library name as)
  set(made)
  if("static" IN_LIST IST_LIBRARY_KINDS)
    add_library(${name} STATIC ${ARGN})
    set(alias ${name})
    list(APPEND made ${name})
  endif()
  if("shared" IN_LIST IST_LIBRARY_KINDS)
    add_library(${name}_shared SHARED ${ARGN})
    # Before 1.0 a minor version may break what the one before it promised.
    set_target_properties(${name}_shared PROPERTIES OUTPUT_NAME ${name}
      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
      INSTALL_RPATH $ORIGIN  # one of the two needs the other, wherever both are moved
      LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/exported.map)
    target_link_options(${name}_shared PRIVATE
      -Wl,--version-script=${PROJECT_SOURCE_DIR}/cmake/exported.map)
    if(IST_SANITIZE)
      target_link_options(${name}_shared PRIVATE -fsanitize=${IST_SANITIZE})
    else()
      target_link_options(${name}_shared PRIVATE -Wl,--no-undefined)
    endif()
    if(BUILD_SHARED_LIBS OR NOT made)
      set(alias ${name}_shared)
    endif()
    list(APPEND made ${name}_shared)
  endif()
  set_target_properties(${made} PROPERTIES EXPORT_NAME ${as} LINKER_LANGUAGE CXX)
  add_library(ist::${as} ALIAS ${alias})
  set(${name}_LIBRARIES ${made} PARENT_SCOPE)
endfunction()
