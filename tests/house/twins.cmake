# cmake -DROOT=<the repository> -P twins.cmake
# Fails on a constant (kName = number) that is defined in both ist/query and cuda/query: such
# constants stand once, in ist/query/asset/shared_constants.h. Fails on a type (class or struct name)
# that two headers define in one namespace.
cmake_minimum_required(VERSION 3.25)

# Constants that may stand in both.
set(exceptions
  kPairsAtOnce kRounding)  # other numbers with other meanings

set(errors)

# The constants of a folder: constant_<folder>_<name> is the file that defines it.
function(find_constants folder out)
  set(names)
  file(GLOB_RECURSE files RELATIVE ${ROOT}
    ${ROOT}/${folder}/*.h ${ROOT}/${folder}/*.cpp ${ROOT}/${folder}/*.cu)
  foreach(file IN LISTS files)
    file(READ ${ROOT}/${file} text)
    string(REPLACE ";" "," text "${text}")
    string(REGEX MATCHALL " k[A-Z][A-Za-z0-9]* = -?[0-9][-+.a-zA-Z0-9]*," found "${text}")
    foreach(constant IN LISTS found)
      string(REGEX REPLACE "^ (k[A-Za-z0-9]*) .*" "\\1" name "${constant}")
      list(APPEND names ${name})
      set(constant_${out}_${name} ${file} PARENT_SCOPE)
    endforeach()
  endforeach()
  set(${out} "${names}" PARENT_SCOPE)
endfunction()

find_constants(ist/query on_cpu)
find_constants(cuda/query on_gpu)
list(REMOVE_DUPLICATES on_gpu)
foreach(name IN LISTS on_gpu)
  if(name IN_LIST on_cpu AND NOT name IN_LIST exceptions)
    list(APPEND errors "${name}: in ${constant_on_cpu_${name}} and ${constant_on_gpu_${name}}")
  endif()
endforeach()
list(LENGTH on_cpu count)
if(count LESS 20)
  message(FATAL_ERROR "ist/query: only ${count} constants found; has their form changed?")
endif()

# Types at the top of their namespace: clang-format leaves those unindented.
file(GLOB_RECURSE headers RELATIVE ${ROOT}
  ${ROOT}/include/*.h ${ROOT}/src/*.h ${ROOT}/ist/*.h ${ROOT}/cuda/*.h ${ROOT}/python/src/*.h)
set(types 0)
foreach(header IN LISTS headers)
  set(open)
  file(STRINGS ${ROOT}/${header} lines ENCODING UTF-8
    REGEX "^(inline )?namespace |^}  // namespace|^(template .*> )?(class|struct|union|enum class) ")
  foreach(line IN LISTS lines)
    if(line MATCHES "^(inline )?namespace ([A-Za-z_:]*)")
      list(APPEND open "${CMAKE_MATCH_2}/")
    elseif(line MATCHES "^}  // namespace")
      list(POP_BACK open)
    elseif(line MATCHES "(class|struct|union) (alignas\\([^)]*\\) )?(IST_[A-Z_]+ )?([A-Za-z0-9_]+)( final)?( : [^;]*)? {")
      list(JOIN open "" namespace)
      set(type "${namespace}${CMAKE_MATCH_4}")
      math(EXPR types "${types} + 1")
      if(DEFINED type_${type} AND NOT type_${type} STREQUAL header)
        list(APPEND errors "${type}: in ${type_${type}} and ${header}")
      endif()
      set(type_${type} ${header})
    endif()
  endforeach()
endforeach()
if(types LESS 300)
  message(FATAL_ERROR "only ${types} types found in the headers; has their form changed?")
endif()

list(LENGTH errors error_count)
if(error_count GREATER 0)
  list(JOIN errors "\n  " text)
  message(FATAL_ERROR "${error_count} errors:\n  ${text}")
endif()
message(STATUS "${types} types, ${count} constants: none stands twice")
