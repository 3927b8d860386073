# Highway's headers only: with a single target they do not need its library, which here is the host's.
add_library(hwy::hwy INTERFACE IMPORTED)
target_include_directories(hwy::hwy INTERFACE ${ist_web_INCLUDE_DIR})
