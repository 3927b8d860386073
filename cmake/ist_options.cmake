# Language, warnings, floating-point rules and sanitizers of every target of this project. A warning ends the
# build, but not that of a project that this one is a part of.
function(ist_compile_options target)
  set_target_properties(${target} PROPERTIES
    CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON
    # Of a shared library only what the public headers declare is seen (ist/api.h).
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
  endif()
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANGUAGE:CXX>:-Werror> $<$<COMPILE_LANGUAGE:CUDA>:--Werror=all-warnings>)
  endif()
  if(IST_SANITIZE)
    # A finding ends the program, so that its test fails.
    target_compile_options(${target} PRIVATE
      -fsanitize=${IST_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${IST_SANITIZE})
  endif()
endfunction()
