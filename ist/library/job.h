#pragma once

#include "library/settings/bake_settings.h"
#include "robots/description/robot_model.h"

namespace ist {

/// Requirements for an asset; a bake that violates them fails. They do not change its bytes.
struct Demands {
  bool mesh = false;      ///< it contains its mesh, for exact queries
  double coverage = 0;    ///< at least; share of the solid's volume
  double confidence = 0;  ///< at least; of a mesh that was open
};

struct Job {
  std::string name;                           ///< of the asset: NAME.ist
  std::string mesh;                           ///< path
  std::optional<PlacedLinkShape> shape = {};  ///< of a robot's link: the mesh in the link's frame
  std::string urdf = {};                      ///< the robot's, for messages
  BakeSettings settings;
  Demands demands;
};

enum class JobStatus {
  baked,      ///< and written
  cached,     ///< taken from the cache
  failed,     ///< `message` gives the reason; nothing was written
  not_baked,  ///< the run was interrupted before or during it; nothing was written
};
const char* name_of(JobStatus status) noexcept;

struct JobResult {
  std::string name, mesh;
  JobStatus status = JobStatus::not_baked;
  std::string message;  ///< of a failure
  double seconds = 0;   ///< wall time from beginning to end
  std::vector<std::string> warnings;

  // Filled in if an asset was written, else empty.
  std::string asset;         ///< path
  std::string content_hash;  ///< AssetHeader's, in 16 digits
  std::uint64_t bytes = 0, spheres = 0;
  double coverage = 0;                             ///< share of the solid's volume
  double volume = 0, protrusion = 0;               ///< as in AssetView
  std::string mesh_state;                          ///< name_of(AssetView::mesh_state())
  std::uint64_t mesh_triangles = 0;                ///< kept for exact queries
  double mesh_error = 0, self_overlap_volume = 0;  ///< as in AssetView
  std::optional<double> target_error, error;  ///< requested and measured, relative; see ErrorTarget
  std::optional<bool> target_met;
  std::optional<double> confidence;  ///< RepairQuality's, for a mesh that was repaired or wrapped

  bool done() const { return status == JobStatus::baked || status == JobStatus::cached; }
};

}  // namespace ist
