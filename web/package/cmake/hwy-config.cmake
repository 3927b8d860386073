# Highway's headers alone: with one target it needs nothing of its library, which here is the host's.
add_library(hwy::hwy INTERFACE IMPORTED)
target_include_directories(hwy::hwy INTERFACE ${ist_web_INCLUDE_DIR})
