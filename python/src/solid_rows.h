#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gpu_solids.h"
#include "solids.h"

// Solids indexed by rows of pairs, in the memory where their answers are needed.

namespace ist::python {

struct Solids {
  Solids(const py::sequence& solids, const std::string& device);

  std::string device() const;

  std::size_t count;
  std::vector<std::size_t> shapes;  ///< the indices of Shapes
  // On the CPU, with the owners of their memory:
  std::vector<Solid> views;
  std::vector<py::object> owners;
  std::unique_ptr<DeviceSolids> on_device;  ///< null: on the CPU
};

/// ist.Solids[index].
struct SolidRows {
  py::object solids;  ///< Solids
  py::object index;   ///< a number for all rows, or an array with one for each

  Solids& among() const { return py::cast<Solids&>(solids); }
};

/// Both solids of a query on a device; null `solids`: they are on the CPU.
struct DeviceSides {
  DeviceSolids* solids = nullptr;
  py::object a, b;  ///< indices
};

/// Refuses one solid on a device and the other elsewhere.
DeviceSides device_sides(const py::object& a, const py::object& b);

void add_solid_rows(py::module_& module);

}  // namespace ist::python
