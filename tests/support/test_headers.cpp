// Only so that there is a target that precompiles headers for the others (tests/CMakeLists.txt).
