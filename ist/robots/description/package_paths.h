#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace ist {

class PackagePaths {
 public:
  /// `urdf`: the robot's file; relative names are relative to its folder. `named`: folders of
  /// packages by name, which come first. Then the folders of the environment's ROS_PACKAGE_PATH
  /// (`ros_path`, separated by colons), then every folder above the URDF: each may be the package
  /// or contain it.
  PackagePaths(const std::filesystem::path& urdf, std::map<std::string, std::string> named,
               const std::string& ros_path);

  /// The file of a name: package://NAME/REST (or model://, or with a third slash), file://PATH or a
  /// path; if that does not exist, the same with %20 and the like decoded. Throws Error that lists
  /// where it was searched; otherwise the file exists.
  std::string find(const std::string& name) const;

 private:
  std::string find_as_written(const std::string& name) const;

  std::filesystem::path folder_;
  std::map<std::string, std::string> named_;
  std::vector<std::filesystem::path> ros_path_;
};

}  // namespace ist
