#include "spheres/cover_parts.h"

#include <algorithm>
#include <string>

#include <ist/error.h>

#include "spheres/shared_count.h"

namespace ist {
namespace {

bool equal(const ClosedMesh& a, const ClosedMesh& b) {
  return a.mesh.triangles == b.mesh.triangles && a.mesh.vertices == b.mesh.vertices;
}

}  // namespace

std::vector<std::size_t> parts_of(std::span<const ClosedMesh> meshes,
                                  const SphereCoverSettings& settings,
                                  std::vector<CoverPart>& parts) {
  std::vector<std::size_t> part_of;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    std::size_t count = settings.counts.empty() ? 0 : settings.counts[i];
    if (count == 0 && settings.total == 0) count = settings.count;
    const auto found = std::find_if(parts.begin(), parts.end(), [&](const CoverPart& part) {
      return part.count == count && equal(*part.mesh, meshes[i]);
    });
    part_of.push_back(static_cast<std::size_t>(found - parts.begin()));
    if (found == parts.end())
      parts.push_back({&meshes[i], count, 1});
    else
      ++found->copies;
  }
  return part_of;
}

std::vector<std::size_t> shared_counts(
    const std::vector<CoverPart>& parts, std::size_t total,
    const std::function<void(const std::vector<std::size_t>&)>& cover) {
  std::vector<std::size_t> counts, copies, open;
  std::size_t fixed = 0, sharers = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    counts.push_back(parts[i].count);
    fixed += parts[i].count * parts[i].copies;
    if (parts[i].count != 0) continue;
    open.push_back(i);
    copies.push_back(parts[i].copies);
    sharers += parts[i].copies;
  }
  if (total < fixed + sharers)
    throw Error("cover: a total of " + std::to_string(total) + " spheres is too small: at least " +
                std::to_string(fixed + sharers) + " are needed. Increase it");
  const std::size_t left = total - fixed;
  std::vector<std::size_t> shares(
      open.size(), std::min(kMostCoverSpheres, left / std::max<std::size_t>(1, sharers)));
  std::vector<std::size_t> best;
  std::vector<double> least;  // protrusions, the largest first
  for (int round = 0; round < kSharingRounds; ++round) {
    for (std::size_t k = 0; k < open.size(); ++k) counts[open[k]] = shares[k];
    cover(counts);
    std::vector<TriedCounts> tried;
    std::vector<double> reached;
    for (std::size_t k = 0; k < open.size(); ++k) {
      tried.emplace_back();
      for (const auto& [count, found] : parts[open[k]].tried)
        tried.back()[count] = found.protrusion.largest;
      reached.push_back(estimated_protrusion(tried[k], shares[k]));
    }
    std::sort(reached.rbegin(), reached.rend());
    if (best.empty() || reached < least) {
      least = reached;
      best = counts;
    }
    std::vector<std::size_t> next = share_out(tried, copies, left);
    if (next == shares) break;
    shares = std::move(next);
  }
  return best;
}

}  // namespace ist
