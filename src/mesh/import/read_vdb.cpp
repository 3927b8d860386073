#include <ist/solid.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <algorithm>
#include <cmath>
#include <filesystem>

namespace ist {
namespace {

using openvdb::FloatGrid;

openvdb::GridBase::Ptr only_grid(const std::string& path) {
  openvdb::io::File file(path);
  file.open(/*delayLoad=*/false);
  std::vector<std::string> names;
  for (auto name = file.beginName(); name != file.endName(); ++name)
    names.push_back(name.gridName());
  if (names.empty()) throw Error(path + ": contains no grid");
  if (names.size() > 1) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "'" : ", '") + name + "'";
    throw Error(path + ": contains " + std::to_string(names.size()) + " grids (" + list +
                "). Write the intended one to its own file");
  }
  return file.readGrid(names.front());
}

FloatGrid::Ptr level_set_of(const openvdb::GridBase::Ptr& base, const std::string& path) {
  const std::string name = "grid '" + base->getName() + "'";
  const FloatGrid::Ptr grid = openvdb::gridPtrCast<FloatGrid>(base);
  if (!grid)
    throw Error(path + ": " + name + " is of type " + base->valueType() +
                ", not float. Convert it to a level set of floats");
  if (grid->getGridClass() != openvdb::GRID_LEVEL_SET)
    throw Error(path + ": " + name + " is of class '" +
                openvdb::GridBase::gridClassToString(grid->getGridClass()) +
                "', not a level set. Convert it (tools::fogToSdf for a fog volume)");
  if (grid->empty()) throw Error(path + ": " + name + " is empty, so there is no solid");
  if (!grid->transform().isLinear())
    throw Error(path + ": " + name + " has a transform that is not linear. Resample it");
  return grid;
}

/// The values in a box around the active ones, in steps of voxels.
DistanceGrid dense_values(const FloatGrid& grid, const std::string& path) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  box.expand(1);
  DistanceGrid dense;
  std::uint64_t count = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<unsigned>(k);
    const std::int64_t points = std::int64_t{box.max()[axis]} - box.min()[axis] + 1;
    if (points > 1 << 20 || (count *= static_cast<std::uint64_t>(points)) > 1u << 31)
      throw Error(path + ": its active voxels span more than 2^31. Resample it with larger ones");
    dense.size[k] = static_cast<std::uint32_t>(points);
    dense.origin[static_cast<int>(k)] = box.min()[axis];
  }
  dense.spacing = 1;
  dense.values.resize(count);
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> target(box, dense.values.data());
  openvdb::tools::copyToDense(grid, target);
  return dense;
}

LevelSetMesh read_level_set(const std::string& path, const ProgressCallback& progress) {
  openvdb::initialize();
  const FloatGrid::Ptr grid = level_set_of(only_grid(path), path);
  LevelSetMesh found = mesh_level_set(dense_values(*grid, path), path, progress);
  // Maps voxels to the world; the transform scales lengths by at most the matrix's entries.
  const openvdb::math::Transform& place = grid->transform();
  TriangleMesh mesh = std::move(found.mesh.mesh);
  for (Eigen::Vector3d& v : mesh.vertices) {
    const openvdb::Vec3d world = place.indexToWorld(openvdb::Vec3d(v.x(), v.y(), v.z()));
    v = {world.x(), world.y(), world.z()};
  }
  const openvdb::Vec3d origin = place.indexToWorld(openvdb::Vec3d(0, 0, 0));
  double squares = 0, longest = 0;
  bool square = true;
  openvdb::Vec3d columns[3];
  for (unsigned k = 0; k < 3; ++k) {
    openvdb::Vec3d step(0, 0, 0);
    step[k] = 1;
    columns[k] = place.indexToWorld(step) - origin;
    squares += columns[k].lengthSqr();
    longest = std::max(longest, columns[k].length());
    for (unsigned j = 0; j < k; ++j)
      square = square && std::abs(columns[j].dot(columns[k])) <= 1e-12 * longest * longest;
  }
  found.error *= (square ? longest : std::sqrt(squares)) * (1 + 1e-9);
  found.mesh = close_mesh(std::move(mesh), path);
  return found;
}

}  // namespace

bool vdb_available() noexcept { return true; }

LevelSetMesh load_vdb(const std::string& path, const ProgressCallback& progress) {
  if (!std::filesystem::is_regular_file(path)) throw Error(path + ": no such file");
  try {
    return read_level_set(path, progress);
  } catch (const openvdb::Exception& error) {
    throw Error(path + ": OpenVDB cannot read it: " + error.what());
  }
}

}  // namespace ist
