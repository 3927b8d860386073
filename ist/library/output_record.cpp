#include "library/output_record.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include <ist/asset_layout.h>
#include <ist/error.h>

namespace ist {
namespace {

using Json = nlohmann::json;

std::string hash_of(const Asset& asset) {
  return fmt::format("{:016x}", asset.view().header().content_hash);
}

}  // namespace

OutputRecord::OutputRecord(const std::filesystem::path& folder) : folder_(folder) {
  std::ifstream file(folder / ".ist-bakes");
  for (std::string text; std::getline(file, text);) {
    try {
      const Json json = Json::parse(text);
      Line line = {json.at("key"), json.at("hash"), json.at("notes"), std::nullopt};
      if (!json.at("confidence").is_null()) line.confidence = json.at("confidence").get<double>();
      lines_[json.at("name")] = std::move(line);
    } catch (const Json::exception&) {
    }
  }
}

std::optional<CacheEntry> OutputRecord::find(const std::string& name, const CacheKey& key) const {
  const auto line = lines_.find(name);
  if (line == lines_.end() || line->second.key != key.text()) return std::nullopt;
  try {
    Asset asset = Asset::load((folder_ / (name + ".ist")).string());
    if (hash_of(asset) != line->second.hash) return std::nullopt;
    return CacheEntry{std::move(asset), line->second.notes, line->second.confidence};
  } catch (const Error&) {
    return std::nullopt;
  }
}

void OutputRecord::add(const std::string& name, const CacheKey& key, const CacheEntry& entry) {
  const Json json = {{"name", name},
                     {"key", key.text()},
                     {"hash", hash_of(entry.asset)},
                     {"notes", entry.notes},
                     {"confidence", entry.confidence ? Json(*entry.confidence) : Json()}};
  // The end of the line comes first: a line that was cut short does not take this one with it.
  const std::string text =
      fmt::format("\n{}", json.dump(-1, ' ', false, Json::error_handler_t::replace));
  const std::lock_guard lock(mutex_);
  std::ofstream file(folder_ / ".ist-bakes", std::ios::app);
  file.write(text.data(), static_cast<std::streamsize>(text.size())).flush();
  if (!file) throw Error((folder_ / ".ist-bakes").string() + ": cannot write");
}

}  // namespace ist
