#include "library/summary.h"

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>

#include <ist/types.h>

namespace ist {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSchema = 1;
constexpr JobStatus kStatuses[] = {JobStatus::baked, JobStatus::cached, JobStatus::failed,
                                   JobStatus::not_baked};

/// Calls visit(key, member, whether null if not done, whether early summaries lack it), in order.
template <class Result, class Visit>
void for_each_field(Result& result, const Visit& visit) {
  constexpr bool kIfDone = true, kLater = true;
  visit("name", result.name);
  visit("status", result.status);
  visit("mesh", result.mesh);
  visit("asset", result.asset, kIfDone);
  visit("content_hash", result.content_hash, kIfDone);
  visit("bytes", result.bytes, kIfDone);
  visit("spheres", result.spheres, kIfDone);
  visit("coverage", result.coverage, kIfDone);
  visit("volume", result.volume, kIfDone, kLater);
  visit("protrusion", result.protrusion, kIfDone, kLater);
  visit("mesh_state", result.mesh_state, kIfDone, kLater);
  visit("mesh_triangles", result.mesh_triangles, kIfDone, kLater);
  visit("mesh_error", result.mesh_error, kIfDone, kLater);
  visit("self_overlap_volume", result.self_overlap_volume, kIfDone, kLater);
  visit("target_error", result.target_error);
  visit("measured_error", result.error);
  visit("target_met", result.target_met);
  visit("confidence", result.confidence, !kIfDone, kLater);
  visit("seconds", result.seconds);
  visit("warnings", result.warnings);
  visit("message", result.message);
}

template <class T>
Json json_of(const T& value) {
  return value;
}
template <class T>
Json json_of(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}
Json json_of(JobStatus status) { return name_of(status); }

template <class T>
void take(const Json& from, const char* key, T& to) {
  if (!from.at(key).is_null()) to = from.at(key).get<T>();
}
template <class T>
void take(const Json& from, const char* key, std::optional<T>& to) {
  if (!from.at(key).is_null()) to = from.at(key).get<T>();
}
void take(const Json& from, const char* key, JobStatus& to) {
  const std::string status = from.at(key);
  const auto* const known = std::find_if(std::begin(kStatuses), std::end(kStatuses),
                                         [&](JobStatus one) { return status == name_of(one); });
  if (known == std::end(kStatuses)) throw Error("unknown status '" + status + "'");
  to = *known;
}

JobResult result_from(const Json& json) {
  JobResult result;
  for_each_field(result, [&](const char* key, auto& value, bool = false, bool later = false) {
    if (!later || json.contains(key)) take(json, key, value);
  });
  return result;
}

}  // namespace

Json to_json(const JobResult& result) {
  Json json;
  for_each_field(result,
                 [&](const char* key, const auto& value, bool if_done = false, bool = false) {
                   json[key] = if_done && !result.done() ? Json() : json_of(value);
                 });
  if (result.message.empty()) json["message"] = nullptr;
  return json;
}

bool Shard::holds(const std::string& name) const {
  return XXH3_64bits(name.data(), name.size()) % count == index - 1;
}

std::size_t Summary::count(JobStatus status) const {
  return static_cast<std::size_t>(
      std::count_if(results.begin(), results.end(),
                    [&](const JobResult& result) { return result.status == status; }));
}

bool Summary::complete() const {
  return std::all_of(results.begin(), results.end(),
                     [](const JobResult& result) { return result.done(); });
}

std::uint64_t hash_of_library(const std::vector<Job>& jobs) {
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  for (const Job& job : jobs) {
    const std::string text = job.name + '\0' + describe_exactly(job.settings) + '\0';
    XXH3_64bits_update(&state, text.data(), text.size());
  }
  return XXH3_64bits_digest(&state);
}

Json to_json(const Summary& summary, bool failed) {
  Json counts, assets = Json::array();
  for (const JobStatus status : kStatuses) counts[name_of(status)] = summary.count(status);
  for (const JobResult& result : summary.results)
    if (!failed || !result.done()) assets.push_back(to_json(result));
  return {{"schema", kSchema},
          {"manifest", summary.manifest},
          {"library_hash", fmt::format("{:016x}", summary.library_hash)},
          {"shard", {{"index", summary.shard.index}, {"count", summary.shard.count}}},
          {"complete", summary.complete()},
          {"counts", counts},
          {"seconds", summary.seconds},
          {"stale", summary.stale},
          {"assets", assets}};
}

Summary read_summary(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path + ": cannot be opened. Check the path and its permissions");
  try {
    const Json json = Json::parse(file);
    if (json.at("schema") != kSchema)
      throw Error(fmt::format("its schema is {}, not {}", json.at("schema").dump(), kSchema));
    Summary summary;
    take(json, "manifest", summary.manifest);
    summary.library_hash = std::stoull(json.at("library_hash").get<std::string>(), nullptr, 16);
    take(json.at("shard"), "index", summary.shard.index);
    take(json.at("shard"), "count", summary.shard.count);
    take(json, "seconds", summary.seconds);
    if (json.contains("stale")) take(json, "stale", summary.stale);
    for (const Json& asset : json.at("assets")) summary.results.push_back(result_from(asset));
    if (summary.shard.count < 1 || summary.shard.index < 1 ||
        summary.shard.index > summary.shard.count)
      throw Error("its shard index is not between 1 and the shard count");
    return summary;
  } catch (const Json::exception&) {
    throw Error(path +
                ": is not a complete summary of `ist bake --manifest … --json`. Run that bake "
                "again");
  } catch (const std::exception& error) {
    throw Error(fmt::format(
        "{}: is not a complete summary of `ist bake --manifest … --json`: {}. Run that bake again",
        path, error.what()));
  }
}

Summary merge(std::vector<Summary> shards) {
  if (shards.empty()) throw Error("no summaries to merge");
  std::sort(shards.begin(), shards.end(),
            [](const Summary& a, const Summary& b) { return a.shard.index < b.shard.index; });
  Summary whole = {.manifest = shards.front().manifest,
                   .library_hash = shards.front().library_hash,
                   .shard = {},
                   .seconds = 0,
                   .stale = {},
                   .results = {}};
  const std::uint32_t count = shards.front().shard.count;
  std::uint32_t next = 1;
  for (const Summary& shard : shards) {
    const std::string name =
        fmt::format("shard {}/{} of {}", shard.shard.index, shard.shard.count, shard.manifest);
    if (shard.library_hash != whole.library_hash || shard.shard.count != count)
      throw Error(
          fmt::format("{} does not belong to the same library and shard count as shard {}/{} of "
                      "{}: bake all shards with one manifest",
                      name, shards.front().shard.index, count, whole.manifest));
    if (shard.shard.index < next) throw Error(name + " is given twice");
    if (shard.shard.index > next)
      throw Error(fmt::format("shard {}/{} of {} is missing", next, count, whole.manifest));
    ++next;
    whole.seconds += shard.seconds;
    whole.stale.insert(whole.stale.end(), shard.stale.begin(), shard.stale.end());
    whole.results.insert(whole.results.end(), shard.results.begin(), shard.results.end());
  }
  if (next <= count)
    throw Error(fmt::format("shard {}/{} of {} is missing", next, count, whole.manifest));
  std::sort(whole.results.begin(), whole.results.end(),
            [](const JobResult& a, const JobResult& b) { return a.name < b.name; });
  std::sort(whole.stale.begin(), whole.stale.end());
  whole.stale.erase(std::unique(whole.stale.begin(), whole.stale.end()), whole.stale.end());
  return whole;
}

}  // namespace ist
