# Resolves IST_CUDA (AUTO, ON, OFF) once: enables the CUDA language, or says that the build is
# CPU only. Afterwards IST_HAVE_CUDA tells which.
set(IST_HAVE_CUDA FALSE)
if(NOT IST_CUDA STREQUAL "OFF")
  find_program(IST_NVCC nvcc PATHS /usr/local/cuda/bin)
  if(IST_NVCC)
    # Code for the H200 (sm_90) and, as PTX, for everything newer.
    set(CMAKE_CUDA_COMPILER ${IST_NVCC})
    set(CMAKE_CUDA_ARCHITECTURES 90)
    set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
    enable_language(CUDA)
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)  # CMake 3.25 does not know how nvcc calls C++20
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
    endif()
    find_package(CUDAToolkit REQUIRED)
    set(IST_HAVE_CUDA TRUE)
  elseif(IST_CUDA STREQUAL "ON")
    message(FATAL_ERROR "IST_CUDA=ON, but there is no nvcc: install the CUDA Toolkit 13, put nvcc "
      "on the PATH, or configure with -DIST_CUDA=OFF")
  else()
    message(NOTICE "ist: no nvcc found, building CPU only")
  endif()
endif()
