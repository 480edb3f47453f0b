// SPDX-License-Identifier: MIT
#include "jobs/slurm/slurm_site.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "engine/core/errors.h"

namespace rattan {

namespace {

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) {
    return std::nullopt;
  }
  return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(at + 1);
  }
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  std::string line;
  while (std::getline(stream, line)) {
    lines.push_back(line);
  }
  return lines;
}

/// The value of `Key = value` in `scontrol show config`.
std::string configured(const std::string& config, std::string_view key) {
  for (const std::string& line : lines_of(config)) {
    std::istringstream words(line);
    std::string name;
    std::string equals;
    std::string value;
    if (words >> name >> equals >> value && name == key && equals == "=") {
      return value;
    }
  }
  return "";
}

/// The value of `Key=value` in a line of `scontrol --oneliner`.
std::string field_of(const std::string& line, const std::string& key) {
  std::istringstream words(line);
  std::string word;
  while (words >> word) {
    if (word.starts_with(key + "=")) {
      return word.substr(key.size() + 1);
    }
  }
  return "";
}

void read_partition(const CommandRunner& run, const std::string& wanted, SlurmSite& site) {
  const CommandOutput answer = run({"scontrol", "--oneliner", "show", "partition"});
  if (answer.code != 0) {
    site.partition = wanted;
    return;
  }
  std::string names;
  // sbatch takes a list of partitions; the first stands for all of them.
  const std::string first = wanted.substr(0, wanted.find(','));
  for (const std::string& line : lines_of(answer.out)) {
    const std::string name = field_of(line, "PartitionName");
    if (name.empty()) {
      continue;
    }
    names += (names.empty() ? "" : ", ") + name;
    if (first.empty() ? field_of(line, "Default") == "YES" : name == first) {
      site.partition = name;
      site.most_minutes = parse_slurm_time(field_of(line, "MaxTime"));
      site.most_mebibytes = number(field_of(line, "MaxMemPerNode"));
    }
  }
  if (site.partition.empty() && !first.empty()) {
    throw UsageError(fmt::format("There is no partition {} here; there are {}.", first, names));
  }
}

void read_nodes(const CommandRunner& run, SlurmSite& site) {
  std::vector<std::string> command{"sinfo", "--noheader", "--exact", "--format=%D %c %m"};
  if (!site.partition.empty()) {
    command.push_back("--partition=" + site.partition);
  }
  const CommandOutput answer = run(command);
  for (const std::string& line : lines_of(answer.out)) {
    std::istringstream words(line);
    SlurmNodes nodes;
    if (words >> nodes.count >> nodes.processors >> nodes.mebibytes && nodes.count > 0) {
      site.nodes.push_back(nodes);
    }
  }
}

}  // namespace

std::uint32_t SlurmSite::processors() const {
  std::uint32_t sum = 0;
  for (const SlurmNodes& kind : nodes) {
    sum += kind.count * kind.processors;
  }
  return sum;
}

std::uint32_t SlurmSite::most_processors() const {
  std::uint32_t most = 0;
  for (const SlurmNodes& kind : nodes) {
    most = std::max(most, kind.processors);
  }
  return most;
}

std::uint64_t SlurmSite::most_memory() const {
  std::uint64_t most = 0;
  for (const SlurmNodes& kind : nodes) {
    most = std::max(most, kind.mebibytes);
  }
  return std::min(most, most_mebibytes.value_or(most));
}

bool SlurmSite::has_room_for(std::uint32_t wanted_processors,
                             std::uint64_t wanted_mebibytes) const {
  return nodes.empty() || std::ranges::any_of(nodes, [&](const SlurmNodes& kind) {
           return kind.processors >= wanted_processors &&
                  std::min(kind.mebibytes, most_mebibytes.value_or(kind.mebibytes)) >=
                      wanted_mebibytes;
         });
}

SlurmSite read_slurm_site(const CommandRunner& run, const std::string& partition) {
  SlurmSite site;
  const CommandOutput config = run({"scontrol", "show", "config"});
  if (config.code != 0) {
    site.partition = partition;
    return site;
  }
  site.known = true;
  // MaxArraySize is one more than the largest index; indexes here start at 1.
  const std::uint64_t size = number(configured(config.out, "MaxArraySize")).value_or(1001);
  const std::uint64_t jobs = number(configured(config.out, "MaxJobCount")).value_or(10000);
  site.most_tasks =
      static_cast<std::uint32_t>(std::clamp<std::uint64_t>(std::min(size, jobs), 2, 4'000'000) - 1);
  read_partition(run, partition, site);
  read_nodes(run, site);
  return site;
}

std::optional<std::uint64_t> parse_slurm_time(const std::string& text) {
  std::string_view rest = text;
  std::uint64_t days = 0;
  const std::size_t dash = rest.find('-');
  const bool with_days = dash != std::string_view::npos;
  if (with_days) {
    const auto value = number(rest.substr(0, dash));
    if (!value) {
      return std::nullopt;
    }
    days = *value;
    rest.remove_prefix(dash + 1);
  }
  std::vector<std::uint64_t> parts;
  for (const std::string_view part : split(rest, ':')) {
    const auto value = number(part);
    if (!value || *value > 100'000'000) {
      return std::nullopt;
    }
    parts.push_back(*value);
  }
  if (parts.size() > 3 || days > 100'000) {
    return std::nullopt;
  }
  std::uint64_t hours = 0;
  std::uint64_t minutes = 0;
  std::uint64_t seconds = 0;
  if (with_days || parts.size() == 3) {
    parts.resize(3);
    hours = parts[0];
    minutes = parts[1];
    seconds = parts[2];
  } else {
    parts.resize(2);
    minutes = parts[0];
    seconds = parts[1];
  }
  return (days * 24 + hours) * 60 + minutes + (seconds + 59) / 60;
}

std::string slurm_time(std::uint64_t minutes) {
  const std::uint64_t days = minutes / 1440;
  const std::string time = fmt::format("{:02}:{:02}:00", minutes / 60 % 24, minutes % 60);
  return days == 0 ? time : fmt::format("{}-{}", days, time);
}

std::uint64_t parse_slurm_memory(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  std::string unit(end, static_cast<const char*>(text.data() + text.size()));
  for (char& letter : unit) {
    letter = letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A') : letter;
  }
  const double scale = unit == "K" || unit == "KB" || unit == "KIB"                   ? 1.0 / 1024.0
                       : unit.empty() || unit == "M" || unit == "MB" || unit == "MIB" ? 1.0
                       : unit == "G" || unit == "GB" || unit == "GIB"                 ? 1024.0
                       : unit == "T" || unit == "TB" || unit == "TIB"                 ? 1048576.0
                                                                                      : 0.0;
  if (error != std::errc() || scale == 0.0 || !(value >= 0.0) || value * scale > 1e12) {
    throw UsageError(fmt::format(
        "--mem {}: not a size of memory. Give e.g. 4000M or 16G, or 0 for all of a node.", text));
  }
  return static_cast<std::uint64_t>(std::ceil(value * scale));
}

}  // namespace rattan
