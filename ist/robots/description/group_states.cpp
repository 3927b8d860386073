#include "robots/description/group_states.h"

#include <algorithm>
#include <cmath>

#include "mesh/import/source_file.h"
#include "mesh/import/text_scanner.h"
#include "mesh/import/xml_document.h"

namespace ist {

std::vector<std::pair<std::string, Positions>> group_states(const RobotModel& robot,
                                                            const std::string& srdf) {
  const SourceFile file = read_source_file(srdf);
  const XmlDocument xml(file);
  if (xml[0].name != "robot") xml.fail(0, "is not an SRDF, which begins with <robot name=\"…\">");
  std::vector<std::pair<std::string, Positions>> states;
  for (std::uint32_t e = xml[0].first_child; e != XmlDocument::kNone; e = xml[e].next_sibling) {
    if (xml[e].name != "group_state") continue;
    Positions& positions =
        states.emplace_back(xml.attribute(e, "name"), default_positions(robot)).second;
    for (std::uint32_t j = xml[e].first_child; j != XmlDocument::kNone; j = xml[j].next_sibling) {
      const auto joint =
          std::find_if(robot.joints.begin(), robot.joints.end(),
                       [&](const RobotJoint& one) { return one.name == xml.attribute(j, "name"); });
      if (xml[j].name != "joint" || joint == robot.joints.end() || !joint->is_free()) continue;
      const std::optional<double> value = parse_real(xml.attribute(j, "value"));
      if (!value || !std::isfinite(*value)) xml.fail(j, "its value is not a finite number");
      positions[static_cast<std::size_t>(joint - robot.joints.begin())] = *value;
    }
  }
  return states;
}

}  // namespace ist
