#pragma once

#include <string>
#include <utility>

#include "arrays.h"

namespace ist::python {

// Parts of the module, each in a file with its name.
void add_meshes(py::module_& module);
void add_assets(py::module_& module);
void add_clash(py::module_& module);
void add_collisions(py::module_& module);
void add_fields(py::module_& module);
void add_gpu(py::module_& package);
void add_gpu_penetration(py::module_& module);
void add_gpu_separation(py::module_& module);
void add_gpu_scene(py::module_& module);
void add_pictures(py::module_& module);
void add_penetration(py::module_& module);
void add_scenes(py::module_& module);
void add_separation(py::module_& module);
void add_surfaces(py::module_& module);
void add_time_of_impact(py::module_& module);

/// An enumerator by its word, else ValueError that lists the words.
template <class Enum, std::size_t kCount>
Enum named(const std::string& word, const char* argument,
           const std::pair<const char*, Enum> (&choices)[kCount]) {
  std::string all;
  for (const auto& [name, value] : choices) {
    if (word == name) return value;
    all += (all.empty() ? "'" : ", '") + std::string(name) + "'";
  }
  throw value_error(std::string(argument) + ": '" + word + "'; one of " + all);
}

}  // namespace ist::python
