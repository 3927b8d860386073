#include "gpu_batch.h"
#include "penetration.h"

namespace ist::python {

/// Patches of a batch, and whether it was well asked.
struct PatchAnswers {
  GpuContactPatches patches;
  QueryStatus* status = nullptr;
};

namespace {

std::uint32_t most_of(const PatchAnswers& to) { return to.patches.most; }

template <auto kColumn>
void set_patches(PatchAnswers& to, void* data) {
  set_column<kColumn>(to.patches, data);
}

}  // namespace

template <>
std::span<const Answer<PatchAnswers>> columns_of() {
  using To = GpuContactPatches;
  static constexpr Answer<PatchAnswers> kColumns[] = {
      {"count", kUInt32, 0, set_patches<&To::count>, "(n,) uint32 patches of each pair.", true},
      {"id", kUInt64, 0, set_patches<&To::id>,
       "(n, m) uint64: identifies a region of a solid. Ascending.", true, most_of},
      {"centroid", kFloat64, 3, set_patches<&To::centroid>, "(n, m, 3) float64 [u] world.", true,
       most_of},
      {"normal", kFloat64, 3, set_patches<&To::normal>,
       "(n, m, 3) float64 unit, from A to B, world; zero where the area is.", true, most_of},
      {"area", kFloat64, 0, set_patches<&To::area>, "(n, m) float64 [u²] |force|.", true, most_of},
      {"depth", kFloat64, 0, set_patches<&To::depth>, "(n, m) float64 [u] volume/area; 0 if none.",
       true, most_of},
      {"volume", kFloat64, 0, set_patches<&To::volume>,
       "(n, m) float64 [u³], summing to the pair's.", true, most_of},
      {"force", kFloat64, 3, set_patches<&To::force>,
       "(n, m, 3) float64 [u²] on B, summing to the pair's.", true, most_of},
      {"torque", kFloat64, 3, set_patches<&To::torque>,
       "(n, m, 3) float64 [u³/rad] about B's origin, summing to the pair's.", true, most_of},
      {"point", kFloat64, 3, set_patches<&To::point>,
       "(n, m, 3) float64 [u] world: on the central axis of the patch's wrench.", true, most_of},
      {"twist", kFloat64, 0, set_patches<&To::twist>,
       "(n, m) float64 [u³] moment about the normal that a force at the point lacks.", true,
       most_of},
      {"status", kUInt32, 0, set_column<&PatchAnswers::status>,
       "(n,) uint32, a QueryStatus: ok, invalid_input or not_held.", true},
  };
  return kColumns;
}

py::object device_patches(const DeviceSides& sides, const GivenRows& given, std::size_t max_patches,
                          const std::string& measure) {
  const Measure which = named(measure, "measure", kGpuMeasures);
  if (max_patches < 1 || max_patches > kMostGpuPatches)
    throw value_error("max_patches: " + std::to_string(max_patches) + "; wanted 1 to " +
                      std::to_string(kMostGpuPatches) + " on a GPU");
  PatchAnswers blank;
  blank.patches.most = static_cast<std::uint32_t>(max_patches);
  return ask<PatchAnswers>(sides, given, blank,
                           [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
                               const PatchAnswers& to, cuda::Stream on) {
                             GpuPenetrations whole;
                             whole.status = to.status;
                             contact_patches_batch(all, pairs, which, workspace, whole, to.patches,
                                                   on);
                           });
}

void add_gpu_patches(py::module_& module) {
  add_answers<PatchAnswers>(module, "ContactPatches",
                            "Patches of a batch: arrays on the device, None if not requested. "
                            "Arrays passed as `out` are the same objects.");
}

}  // namespace ist::python
