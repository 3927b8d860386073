#include <nlohmann/json.hpp>

#include "cli/program.h"

// The one rule for numbers on the command line: decimal, in range, or exit code 2 with the option's
// name and what it takes.

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;
using Arguments = std::vector<std::string>;

const Arguments kBake = {"bake", "cube.obj", "-o", "new.ist", "--spheres", "5", "--json"};
const Arguments kMedial = {"medial", "cube.obj", "-o", "new.csv", "--resolution", "8"};
const Arguments kExport = {"export", "cube.ist", "-o", "new.csv"};
const Arguments kCheck = {"check", "cube.ist", "--mesh", "cube.obj"};
const Arguments kQuery = {"query", "cube.ist", "cube.ist", "--pose", "1,0,0,0,0.5,0,0"};
const Arguments kTarget = {"bake", "cube.obj", "-o", "new.ist", "--json", "--target-error", "20%"};

struct Option {
  Arguments command;
  std::string name, range;
  Arguments refused;
};

/// A case for every option that takes a number.
const std::vector<Option> kWhole = {
    {kBake, "--spheres", "from 0 to 2147483647", {"2147483648"}},
    {kBake, "--grid-resolution", "from 0 to 1024", {"1025"}},
    {kBake, "--grid-start", "from 0 to 1024", {"1025", "99999999999"}},
    {kBake, "--grid-refinements", "from -1 to 10", {"-2", "11"}},
    {kBake, "--grid-rounds", "from 0 to 4294967295", {"4294967296"}},
    {kBake, "--threads", "from 0 to 4294967295", {"4294967296"}},
    {kBake, "--seed", "from 0 to 18446744073709551615", {"18446744073709551616"}},
    {kMedial, "--resolution", "from 0 to 1024", {"1025"}},
    {kMedial, "--threads", "from 0 to 4294967295", {"4294967296"}},
    {kMedial, "--seed", "from 0 to 18446744073709551615", {"18446744073709551616"}},
    {kExport, "--detail", "from 0 to 4294967295", {"4294967296"}},
    {kCheck, "--threads", "from 0 to 4294967295", {"4294967296"}},
    {kQuery, "--pair-budget", "from 0 to 4294967295", {"4294967296"}},
    {kQuery, "--max-visits", "from 0 to 4294967295", {"4294967296"}},
    {kQuery, "--repeat", "from 1 to 18446744073709551615", {"0"}},
};
const std::vector<Option> kReal = {
    {kBake, "--coverage", "from 0 to 1, or from 0% to 100%", {"1.1", "-1", "101%", "%"}},
    {kBake, "--epsilon", "from 0 to below 1, or from 0% to below 100%", {"1", "100%", "-0.1"}},
    {kBake, "--target-error", "above 0 and below 1, or above 0% and below 100%", {"0", "1", "0%"}},
    {kTarget, "--at-overlap", "from 0.0001 to 0.5, or from 0.01% to 50%", {"0", "0.6", "51%"}},
    {kBake, "--min-radius", "a finite number, 0 or more", {"-1"}},
    {kBake, "--scale", "a finite number other than 0, or three", {"0", "1,0,1", "1,1"}},
    {kCheck, "--scale", "a finite number other than 0, or three", {"0", "1,0,1", "1,1"}},
    {kBake, "--time", "a finite number, 0 or more", {"-1"}},
    {kQuery, "--scale-b", "a finite number above 0", {"0", "-1"}},
};

/// The command with the option, in place of one that it has already.
Arguments with(Arguments command, const std::string& name, const std::string& value) {
  for (std::size_t i = 0; i < command.size(); ++i)
    if (command[i] == name) {
      command[i + 1] = value;
      return command;
    }
  command.insert(command.end(), {name, value});
  return command;
}

class Numbers : public CommandLine {
 protected:
  void expect_refused(const Option& option, const std::string& value) {
    const Outcome outcome = ist(with(option.command, option.name, value));
    EXPECT_EQ(outcome.exit_code, 2) << option.name << " " << value << "\n" << outcome.err;
    const std::string message = option.name + ": '" + value + "' is not ";
    const std::size_t at = outcome.err.find(message);
    EXPECT_NE(at, std::string::npos) << message << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(option.range), std::string::npos) << option.range << "\n"
                                                                 << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(new_files().empty());
  }
  nlohmann::json asked(const Arguments& arguments) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out).at("asked");
  }
};

TEST_F(Numbers, WholeOnesOutOfRangeAreRefused) {
  for (const Option& option : kWhole) {
    for (const std::string& value : option.refused) expect_refused(option, value);
    for (const char* value : {"nan", "1.5", "1e3", "0x10", "5x", "", "50%"})
      expect_refused(option, value);
  }
}

TEST_F(Numbers, RealOnesOutOfRangeAreRefused) {
  for (const Option& option : kReal) {
    for (const std::string& value : option.refused) expect_refused(option, value);
    for (const char* value : {"nan", "inf", "-inf", "1e999", "x", "0.1x", "", "nan%"})
      expect_refused(option, value);
  }
}

TEST_F(Numbers, LeadingZerosAreNotOctal) {
  EXPECT_EQ(asked(with(kBake, "--spheres", "0123")).at("spheres"), 123);
  EXPECT_EQ(asked(with(kBake, "--seed", "010")).at("seed"), 10);
  const Arguments hybrid = with(kBake, "--grid", "hybrid");
  EXPECT_EQ(asked(with(hybrid, "--grid-resolution", "010")).at("grid_resolution"), 10);
  EXPECT_EQ(asked(with(hybrid, "--grid-start", "08")).at("grid_start"), 8);
  EXPECT_EQ(asked(with(hybrid, "--grid-refinements", "01")).at("grid_refinements"), 1);
  EXPECT_EQ(asked(with(hybrid, "--grid-rounds", "010")).at("grid_rounds"), 10);
  // Elsewhere an 8 shows it: it is not an octal digit.
  for (const Option& option : kWhole) {
    if (option.name.starts_with("--grid") || option.name == "--detail") continue;
    const Outcome outcome = ist(with(option.command, option.name, "08"));
    EXPECT_EQ(outcome.exit_code, 0) << option.name << "\n" << outcome.err;
  }
  const Outcome detail = ist(with(kExport, "--detail", "08"));
  EXPECT_NE(detail.err.find("--detail 8 is out of range"), std::string::npos) << detail.err;
}

TEST_F(Numbers, SharesMayBePercentages) {
  EXPECT_EQ(asked(with(kBake, "--coverage", "50%")).at("coverage"), 0.5);
  EXPECT_EQ(asked(with(kBake, "--epsilon", "20%")).at("epsilon"), 0.2);
  EXPECT_EQ(asked(with(kTarget, "--at-overlap", "1%")).at("at_overlap"), 0.01);
  EXPECT_EQ(asked(kTarget).at("error"), 0.2);
}

TEST_F(Numbers, HelpShowsTheDefaults) {
  const std::string help = ist({"bake", "--help"}).out;
  for (const char* text : {"--spheres INT=10000", "--coverage SHARE=1", "--min-radius NUMBER=0",
                           "--grid-refinements INT=-1", "--at-overlap SHARE=0.1%"})
    EXPECT_NE(help.find(text), std::string::npos) << text << "\n" << help;
}

}  // namespace
