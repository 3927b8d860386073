# Resolves IST_CUDA (AUTO, ON, OFF) once: enables the CUDA language, or says that the build is
# CPU only. Afterwards IST_HAVE_CUDA tells which. A toolkit of the system goes before the one that
# ./dev setup --cuda brings.
set(IST_HAVE_CUDA FALSE)
if(NOT IST_CUDA STREQUAL "OFF")
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    find_program(IST_NVCC nvcc
      PATHS /usr/local/cuda/bin ${PROJECT_SOURCE_DIR}/build-cuda-toolkit/nvidia/cu13/bin)
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
    # The runtime alone is needed. find_package(CUDAToolkit) is not asked: CMake 3.25.1 looks in CUDA
    # 13 for what that no longer has.
    if(NOT TARGET CUDA::cudart_static)
      find_package(Threads REQUIRED)
      find_library(IST_CUDART cudart_static HINTS ${CMAKE_CUDA_HOST_IMPLICIT_LINK_DIRECTORIES} REQUIRED)
      add_library(CUDA::cudart_static STATIC IMPORTED)
      set_target_properties(CUDA::cudart_static PROPERTIES IMPORTED_LOCATION ${IST_CUDART}
        INTERFACE_INCLUDE_DIRECTORIES "${CMAKE_CUDA_TOOLKIT_INCLUDE_DIRECTORIES}"
        INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS};rt")
    endif()
    set(IST_HAVE_CUDA TRUE)
  elseif(IST_CUDA STREQUAL "ON")
    message(FATAL_ERROR "IST_CUDA=ON, but there is no nvcc: ./dev setup --cuda brings it. Or install "
      "the CUDA Toolkit 13, put nvcc on the PATH or name it in CMAKE_CUDA_COMPILER, or configure with "
      "-DIST_CUDA=OFF")
  else()
    message(NOTICE "ist: no nvcc found, building CPU only (./dev setup --cuda brings it)")
  endif()
endif()
