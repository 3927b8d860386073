# Language, warnings, floating-point rules and sanitizers of every target of this project. A warning ends the
# build, but not that of a project that this one is a part of.
include(CheckIncludeFileCXX)

function(ist_compile_options target)
  ist_precompile(${target})
  set_target_properties(${target} PROPERTIES
    CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON
    # Of a shared library only what the public headers declare is seen (ist/types.h).
    CXX_VISIBILITY_PRESET hidden CUDA_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${target} PRIVATE
    # The same bytes on any machine (docs/design.md 3.3): nothing is fused or re-associated.
    $<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wconversion;-ffp-contract=off>
    $<$<COMPILE_LANGUAGE:CUDA>:-fmad=false;-Xcompiler=-Wall,-Wextra,-ffp-contract=off>
    # Code for six generations, packed, takes the room of one that is not.
    $<$<COMPILE_LANGUAGE:CUDA>:-compress-mode=size>)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    # Eigen's products for NEON are fused by hand where this macro is defined.
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-U__ARM_FEATURE_FMA>)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # It inlines Highway's functions for NEON only where the cryptography extension is named, of
      # which nothing here makes use. All sources have the flag, as they share headers.
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-march=armv8-a+crypto>)
    endif()
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Its collector of garbage took an eighth of its time; memory grows by a twentieth (1.1 to 1.2 GB).
    set(collect_late --param=ggc-min-heapsize=524288)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:${collect_late}>
      $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=${collect_late}>)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # It takes the move of a std::string for a copy out of bounds where much is inlined.
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-array-bounds;-Wno-stringop-overread>)
  endif()
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANGUAGE:CXX>:-Werror> $<$<COMPILE_LANGUAGE:CUDA>:--Werror=all-warnings>)
  endif()
  if(IST_SANITIZE)
    # A finding ends the program, so that its test fails. Checks of each pointer that is followed take
    # more than half of the compile time; the address sanitizer reports what they would, but for
    # alignment, which the fuzzers check.
    set(left_out "null,alignment,object-size,pointer-overflow,vptr")
    target_compile_options(${target} PRIVATE -fsanitize=${IST_SANITIZE}
      "$<$<NOT:$<BOOL:${IST_FUZZ}>>:-fno-sanitize=${left_out}>" -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${IST_SANITIZE})
  endif()
endfunction()

# Headers of others take most of the compiler's time, so they are compiled once for libraries and
# once for programs, whose flags differ. A directory whose sources include more sets IST_MORE_HEADERS
# (a name, then headers) and IST_MORE_LIBS, which they need.
# -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON shows what a source forgot to include. ccache needs
# CCACHE_SLOPPINESS=pch_defines,time_macros.
function(ist_precompile target)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  get_target_property(type ${target} TYPE)
  set(more ${IST_MORE_HEADERS})
  list(POP_FRONT more owner)
  if(type STREQUAL "EXECUTABLE" AND CMAKE_CROSSCOMPILING)
    return()  # ./dev arm64 builds three programs, of a source or two each
  elseif(type STREQUAL "EXECUTABLE")
    string(PREPEND owner "ist_headers_of_programs")
  else()
    string(PREPEND owner "ist_headers_of_libraries")
  endif()
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)
  if(target STREQUAL owner)
    # TBB, Eigen and <random> bring the compiler's intrinsics, 2 MB of them.
    check_include_file_cxx(immintrin.h IST_HAVE_INTRINSICS)
    set(headers "<Eigen/Geometry>" "<algorithm>" "<array>" "<atomic>" "<filesystem>" "<fstream>"
      "<functional>" "<map>" "<memory>" "<mutex>" "<optional>" "<random>" "<set>" "<sstream>" "<string>"
      "<thread>" "<unordered_map>" "<vector>" ${more})
    if(IST_HAVE_INTRINSICS)
      list(PREPEND headers "<immintrin.h>")
    endif()
    list(TRANSFORM headers REPLACE "(.+)" "$<$<COMPILE_LANGUAGE:CXX>:\\1>")
    target_precompile_headers(${target} PRIVATE ${headers})
    return()
  endif()
  if(NOT TARGET ${owner})
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/headers.cpp CONTENT "int main() {}\n")
    if(type STREQUAL "EXECUTABLE")
      add_executable(${owner} EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/headers.cpp)
    else()
      add_library(${owner} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/headers.cpp)
    endif()
    target_link_libraries(${owner} PRIVATE Eigen3::Eigen ${IST_MORE_LIBS})
    ist_compile_options(${owner})
  endif()
  target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()
