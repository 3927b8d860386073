# Resolves IST_CUDA (AUTO, ON, OFF) once: enables the CUDA language, or says that the build is
# CPU only. Afterwards IST_HAVE_CUDA tells which.
set(IST_HAVE_CUDA FALSE)
if(NOT IST_CUDA STREQUAL "OFF")
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    find_program(IST_NVCC nvcc PATHS /usr/local/cuda/bin)
    if(IST_NVCC)
      set(CMAKE_CUDA_COMPILER ${IST_NVCC})
    endif()
  endif()
  if(CMAKE_CUDA_COMPILER OR DEFINED ENV{CUDACXX})
    if(NOT CMAKE_CUDA_ARCHITECTURES)
      if(NOT "$ENV{CUDAARCHS}" STREQUAL "")  # CMake itself reads it on the first run only
        set(CMAKE_CUDA_ARCHITECTURES $ENV{CUDAARCHS} CACHE STRING "CUDA architectures")
      else()
        # Every generation that CUDA 13 knows, and PTX for those to come. Code for 8.0 runs on 8.6
        # and 8.9 as it is, and so within the others.
        set(CMAKE_CUDA_ARCHITECTURES 75-real 80-real 90-real 100-real 110-real 120)
      endif()
    endif()
    enable_language(CUDA)
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)  # CMake 3.25 does not know how nvcc calls C++20
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
    endif()
    find_package(CUDAToolkit REQUIRED)
    set(IST_HAVE_CUDA TRUE)
  elseif(IST_CUDA STREQUAL "ON")
    message(FATAL_ERROR "IST_CUDA=ON, but there is no nvcc: install the CUDA Toolkit 13, put nvcc "
      "on the PATH or name it in CMAKE_CUDA_COMPILER, or configure with -DIST_CUDA=OFF")
  else()
    message(NOTICE "ist: no nvcc found, building CPU only")
  endif()
endif()
