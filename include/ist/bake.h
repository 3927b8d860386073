#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <ist/api.h>
#include <ist/mesh.h>
#include <ist/packing.h>
#include <ist/tree_view.h>

namespace IST_API ist {

/// The bytes of an asset in memory that owns them, aligned to 64 bytes. Once moved from it is
/// empty.
class Asset {
 public:
  /// Copies the bytes. Throws Error, naming `name`, unless TreeView::from_bytes accepts them.
  Asset(std::span<const std::byte> bytes, const std::string& name);

  Asset(Asset&& other) noexcept : Asset() { swap(other); }
  Asset& operator=(Asset&& other) noexcept {
    Asset taken(std::move(other));
    swap(taken);
    return *this;
  }

  /// Reads a file written by save(). Throws Error (file, what is wrong, way out).
  static Asset load(const std::filesystem::path& path);

  /// Writes to a temporary file beside `path` and renames it: the old file or the whole new one
  /// is there at every moment. Throws Error.
  void save(const std::filesystem::path& path) const;

  std::span<const std::byte> bytes() const noexcept { return {data_.get(), size_}; }
  const TreeView& view() const noexcept { return view_; }

 private:
  Asset() = default;
  void swap(Asset& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(view_, other.view_);
  }

  struct AlignedDelete {
    void operator()(std::byte* p) const noexcept;
  };
  std::unique_ptr<std::byte[], AlignedDelete> data_;
  std::size_t size_ = 0;
  TreeView view_;
};

/// Makes the asset of a closed mesh: inner spheres, matched spheres, cover radii, trees, the mesh
/// and the field.
///
/// Same mesh, settings and seed give the same bytes on any machine, CPU or GPU, for any number of
/// threads.
/// Cancelling during packing keeps what is packed; before and after it throws Error.
///
/// A mesh that counts volume twice is resolved first: the bake is that of the boundary of where its
/// winding number is 1 or more (MeshState::resolved). If it cannot be resolved, no mesh is kept
/// (MeshState::unresolved), and there is no field where it reaches far into itself.
///
/// Throws Error if not one sphere fits, on settings out of range, and where floats cannot be as
/// exact as the surface's error asked for.
Asset bake(const ClosedMesh& mesh, const PackingSettings& settings = {},
           const ProgressCallback& progress = {});

/// Makes the asset of a surface alone: the mesh, mass and bounds, without spheres and field. It
/// takes about as long as the import.
///
/// Measure::exact and mass_properties() are answered; what asks spheres answers
/// QueryStatus::not_held.
///
/// `threads`: 0 = all cores. Progress tells of the stage "resolve" alone.
/// Throws Error where nothing is `wanted`, where the mesh counts volume twice and cannot be
/// resolved, if the callback cancels, and as bake() does.
Asset bake_surface(const ClosedMesh& mesh, const SurfaceSettings& settings = {},
                   unsigned threads = 0, const ProgressCallback& progress = {});

/// How the mesh in the place of a solid is made, which calibration needs.
struct PolygoniseSettings {
  /// Cells along the longest side of the bounds, [8, 1024]. Time and memory grow by the square.
  /// 0: as many as the sphere count needs, 32 to 256, for an error of some 5 % of the mean radius,
  /// and up to four times that where curved faces meet at an edge.
  unsigned cells = 0;
  std::string name = "solid";  ///< for messages; no part of the asset
};

/// Makes the asset of any solid known by its signed distance: CSG, functions, distance grids.
///
/// Inner spheres and cover radii are certified against the solid itself, on the CPU, by the banded
/// mode alone. Matched spheres and the volume are those of a mesh in its place, whose surface and
/// the solid's lie within a proven distance of each other: it is in the asset
/// (AssetHeader::polygonise_error, kFlagPolygonised), and counts into the protrusion.
/// The volume's error is what the mesh's differs from solid.volume(), and that one's error.
///
/// Where solid.mesh() is a mesh, this is the bake of that mesh.
///
/// Same solid, settings and cells give the same bytes for any number of threads; on any machine as
/// far as signed_distance() does.
/// The solid is asked from many threads at once, and at some points outside its bounds.
/// Progress tells of the stage "polygonise" first. Cancelling it throws Error.
///
/// Throws Error as the bake of a mesh does, and where the signed distance is found not to be
/// 1-Lipschitz or not finite, where the solid reaches out of its bounds, where no cell sees it, and
/// for a grid mode other than banded.
Asset bake(const Solid& solid, const PackingSettings& settings = {},
           const ProgressCallback& progress = {}, const PolygoniseSettings& meshing = {});

/// How exact an asset's volumes are to be.
struct ErrorTarget {
  double relative_error = 0.01;  ///< (0, 1) median over random poses, for every TrialPartner
  double at_overlap = 0.001;     ///< [1e-4, 0.5] of the solid's volume, within half a decade
};

/// How an asset answers where one kind of partner meets it, near the overlap asked about.
struct PartnerError {
  TrialPartner partner = TrialPartner::copy;
  double median = 0;        ///< relative
  std::uint32_t poses = 0;  ///< behind it; too few to count where the overlap is too much for it
};

/// What bake_to_error() made of its target. TreeView::predicted_errors() tells more.
struct TargetedAsset {
  Asset asset;
  double measured_error = 0;  ///< relative, median near the overlap asked about, worst partner's
  std::uint32_t poses = 0;    ///< of all partners; 0: none was tried, for want of time or of room
  std::array<PartnerError, kTrialPartners> partners = {};  ///< what each erred
  bool met = false;  ///< poses > 0 and measured_error ≤ the one asked for
  /// What ended the search. sphere_count where met: few spheres do; where missed: as many as are
  /// allowed do not. time_limit: the best asset until then, met or not. Else the limit by which the
  /// packing could not grow.
  StopReason stop = StopReason::sphere_count;
};

/// bake() with about as few spheres as the target needs, at most settings.max_spheres (0 =
/// 200,000). Where those are not enough: the best asset, and the result says so.
///
/// The asset meets a copy of itself and, as an analytic field, each other TrialPartner: the target
/// is met if the worst one's median is. The truth is integrated over the meshes at some 300 poses
/// with independent random rotations, several times as exact as the target; the asset holds the
/// medians of the copies and which partner is worst.
/// settings.time_limit bounds all of it, but for its first bake, of a few hundred spheres.
/// Takes up to about six times a bake of the final count.
/// Reports the stages of each bake, and "predict".
///
/// Throws Error as bake() does, and whenever the callback cancels.
TargetedAsset bake_to_error(const ClosedMesh& mesh, const ErrorTarget& target,
                            const PackingSettings& settings = {},
                            const ProgressCallback& progress = {});

/// One proven property of an asset.
struct Invariant {
  std::string name;  ///< "sphere inside solid", …
  /// Largest violation measure, unit as in `meaning`; ≤ 0 is sound unless stated.
  double worst = 0;
  std::string meaning;      ///< what `worst` measures, with its unit
  std::size_t where = 0;    ///< index of the sphere, node, triangle or place of cells that is worst
  std::size_t checked = 0;  ///< how many of them, or pairs, were looked at
  std::size_t violations = 0;
};

/// Proves every invariant of an asset again, in double, from its bytes and the mesh alone.
///
/// It shares no code with packing but the mesh.
///
/// `threads`: 0 = all cores. Throws Error if the asset is of another mesh.
std::vector<Invariant> check(const Asset& asset, const ClosedMesh& mesh, unsigned threads = 0);

/// The same for an asset of any solid, from its bytes and the solid's signed distance alone.
///
/// What was calibrated by a mesh in the solid's place is proven by that mesh, made again.
///
/// Throws Error if the asset is of another solid, as far as that mesh shows it, or the solid is a
/// mesh: its ClosedMesh serves then.
std::vector<Invariant> check(const Asset& asset, const Solid& solid, unsigned threads = 0);

}  // namespace ist
