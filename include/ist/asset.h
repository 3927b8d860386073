#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include <ist/types.h>

namespace IST_API ist {

struct AssetHeader;  // the layout: ist/asset_layout.h

namespace detail {
extern const AssetHeader kEmptyAsset;  // no spheres, no volume
}

/// Why bytes were not accepted as an asset.
enum class AssetStatus : std::uint32_t {
  ok = 0,
  too_short,       ///< fewer bytes than the header says
  misaligned,      ///< the span must start on a 64-byte boundary
  not_an_asset,    ///< wrong magic
  other_version,   ///< written by another 0.x format: bake again
  corrupt_hash,    ///< content differs from its XXH3
  corrupt_layout,  ///< an offset, count or field out of range
};

/// One English sentence for a status; never null.
const char* describe(AssetStatus status) noexcept;

/// Partner of a solid in the trials of bake_to_error().
enum class TrialPartner : std::uint32_t {
  copy = 0,    ///< of itself
  plane = 1,   ///< HalfSpaceShape
  ball = 2,    ///< 0.1 to 0.3 of the solid's diagonal across
  edge = 3,    ///< of a box of that size, edge first
  corner = 4,  ///< likewise with a corner first
  plate = 5,   ///< of that size, 0.02 of the diagonal thick; any side first
};
inline constexpr std::uint32_t kTrialPartners = 6;

/// The state of an asset's mesh.
enum class MeshState : std::uint32_t {
  none = 0,         ///< none was requested
  own = 1,          ///< all triangles of the mesh that was baked
  resolved = 2,     ///< volume that the mesh counted twice was cut away
  polygonised = 3,  ///< made from a signed distance; AssetView::mesh_error() bounds its error
  unresolved = 4,   ///< no mesh: it counts volume twice (AssetView::self_overlap_volume)
};

/// Errors of penetration volumes, measured by bake_to_error() on trial poses: by class of overlap
/// of two copies of the solid, and near one overlap of other partners too. Overlaps are shares of
/// the smaller copy's volume, errors are relative.
struct PredictedErrors {
  struct OverlapClass {
    double from = 0, to = 0;  ///< [0, 1] overlaps of the class; both 1: the smaller is contained
    double median = 0;        ///< ≥ 0, 0.01 = 1 %; 0 also if no such pose was found
  };
  std::uint32_t poses = 0;              ///< of all classes together; 0: nothing is predicted
  std::array<OverlapClass, 5> classes;  ///< deepest first
  double target_error = 0;              ///< requested; 0: none
  double target_overlap = 0;            ///< overlap for which it was requested
  /// Median within half a decade of target_overlap, of the worst partner there.
  double measured_error = 0;
  std::uint32_t measured_poses = 0;  ///< of all partners; 0: nothing was measured there
  TrialPartner worst_partner = TrialPartner::copy;
  /// The target was requested, measured and reached.
  bool target_met() const noexcept { return measured_poses > 0 && measured_error <= target_error; }
};

/// A checked, read-only view of an asset's bytes: a file, mapped memory or a buffer. One pointer;
/// the bytes must outlive it. Copy freely, share between threads.
class AssetView {
 public:
  AssetView() = default;

  /// Checks everything before use (hash, offsets, counts, finiteness) without allocating. On any
  /// status other than ok, `out` is left empty.
  ///
  /// `bytes` must start on a 64-byte boundary, as mapped files do.
  static AssetStatus from_bytes(std::span<const std::byte> bytes, AssetView& out) noexcept;

  bool empty() const noexcept { return header_ == nullptr; }
  std::size_t sphere_count() const noexcept;
  double volume() const noexcept;      ///< [u³] of the solid
  double coverage() const noexcept;    ///< [0, 1] share of the volume in inner spheres
  double protrusion() const noexcept;  ///< [u] bound on how far matched spheres stick out of the
                                       ///< solid
  /// True if the asset stores the solid's mesh, which Measure::exact needs. An asset with a mesh
  /// and no spheres is a mesh alone: queries of spheres return QueryStatus::missing_data.
  bool has_mesh() const noexcept;
  std::uint32_t mesh_triangles() const noexcept;  ///< 0 without a mesh
  /// [u] The mesh's surface and the solid's lie within this of each other, its rounding included; 0
  /// without a mesh.
  double mesh_error() const noexcept;
  MeshState mesh_state() const noexcept;  ///< none for an empty view
  /// [u³] Volume that the input mesh counts more than once, or below zero; 0 for a mesh that winds
  /// around every point of its solid once. An estimate for MeshState::unresolved.
  double self_overlap_volume() const noexcept;
  /// `poses` is 0 for an asset of bake() and for an empty view.
  PredictedErrors predicted_errors() const noexcept;

  /// The checked bytes behind the view (ist/asset_layout.h); for an empty view a header without
  /// spheres.
  const AssetHeader& header() const noexcept {
    return header_ != nullptr ? *header_ : detail::kEmptyAsset;
  }

 private:
  const AssetHeader* header_ = nullptr;
};

/// The bytes of an asset in memory, aligned to 64 bytes. Empty once moved from.
class Asset {
 public:
  /// Copies the bytes. Throws Error, naming `name`, unless AssetView::from_bytes accepts them.
  Asset(std::span<const std::byte> bytes, const std::string& name);

  Asset(Asset&& other) noexcept : Asset() { swap(other); }
  Asset& operator=(Asset&& other) noexcept {
    Asset taken(std::move(other));
    swap(taken);
    return *this;
  }

  /// Reads a file of `ist bake` or save(). Throws Error (file, what is wrong, remedy).
  static Asset load(const std::filesystem::path& path);

  /// Writes to a temporary file beside `path` and renames it: at every moment `path` is the old
  /// file or the whole new one. Throws Error. Needs ist::ist.
  void save(const std::filesystem::path& path) const;

  std::span<const std::byte> bytes() const noexcept { return {data_.get(), size_}; }
  const AssetView& view() const noexcept { return view_; }

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
  AssetView view_;
};

}  // namespace ist
