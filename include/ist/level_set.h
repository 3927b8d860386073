#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <ist/api.h>
#include <ist/mesh.h>
#include <ist/progress.h>
#include <ist/solid.h>

namespace IST_API ist {

/// Signed distances at the points of a lattice, negative inside. A band around the surface
/// suffices: beyond it only the sign matters.
struct DistanceGrid {
  std::array<std::uint32_t, 3> size = {};            ///< points along x, y, z, each ≥ 2
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [u] of the first point
  double spacing = 0;                                ///< [u] of neighbours, > 0
  std::vector<float> values;                         ///< [u] x runs fastest, then y
};

/// The mesh of a level set.
struct LevelSetMesh {
  ClosedMesh mesh;   ///< [u]
  double error = 0;  ///< [u] proven: its surface and the level set lie within this of each other
};

/// The solid where the trilinear interpolation of a grid is < 0, as a mesh: a vertex in every cell
/// whose eight points have both signs, with sharp edges and corners. It is a mesh like any other:
/// bake() takes it, also on a GPU, and check() proves against it.
///
/// Distances inside are computed from the mesh, so a narrow band is enough. Values need not be
/// distances: only their zero counts. The error is proven from the steepest slope near the surface,
/// and is larger where slopes differ much there. Runs on the current threads of TBB; the bytes do
/// not depend on their number.
///
/// Throws Error, naming `name`, for mismatched sizes, values that are not finite, a grid without
/// inside points, a solid that reaches the grid's border, and if progress cancels (stage
/// "polygonise").
LevelSetMesh mesh_level_set(const DistanceGrid& grid, const std::string& name,
                            const ProgressCallback& progress = {});

/// The same as a Solid, by its mesh.
std::unique_ptr<Solid> make_grid_solid(const DistanceGrid& grid);

/// Whether this library was built with OpenVDB.
bool vdb_available() noexcept;

/// The level set of an OpenVDB file: its one grid, of floats and marked as a level set, with any
/// linear transform. [u] is the file's world unit.
///
/// load_mesh() reads a .vdb this way too, so every function that takes a mesh file takes such a
/// file. OpenVDB reads the file: do not use it for untrusted files.
///
/// Throws Error (file, what is wrong, remedy) for a file of several grids or none, a grid of
/// another kind, a fog volume, as mesh_level_set() does, and without OpenVDB.
LevelSetMesh load_vdb(const std::string& path, const ProgressCallback& progress = {});

/// The same as a Solid, by its mesh.
std::unique_ptr<Solid> load_vdb_solid(const std::string& path);

}  // namespace ist
