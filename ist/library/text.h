#pragma once

#include <ist/bake.h>
#include <ist/query.h>
#include <nlohmann/json_fwd.hpp>

#include "library/settings/bake_settings.h"

// Prints numbers and names, for people and as JSON.

namespace ist {

/// For files and --json. Names that are not UTF-8 are written with replacement characters.
std::string json_text(const nlohmann::ordered_json& json, int indent = 2);

/// A field of a CSV, quoted if necessary.
std::string csv_field(const std::string& text);
std::string grouped(std::uint64_t count);  ///< 10,000
std::string short_vector(const Eigen::Vector3d& v);

const char* name_of(StopReason reason) noexcept;
const char* name_of(QueryStatus status) noexcept;
const char* name_of(TrialPartner partner) noexcept;

}  // namespace ist
