// SPDX-License-Identifier: MIT
#include "jobs/slurm/task_plan.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/batch/shards.h"

namespace rattan {

namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
/// Tasks of a few processors find a place sooner than whole nodes, and a batch fills either.
constexpr std::uint32_t kProcessors = 4;
constexpr std::uint32_t kProcessorsOfLarge = 8;
/// MiB a processor where the site doesn't tell, and at most for scans that share a task: what one
/// of them needs, every task of the array asks for.
constexpr std::uint64_t kUsualShare = 2048;
/// MiB of the process that watches over the scans.
constexpr std::uint64_t kParent = 64;
constexpr std::uint64_t kSmallestTask = 512;
/// A task is worth its start from a minute on; half an hour loses little when a node dies.
constexpr double kShortTask = 60.0;
constexpr double kLongTask = 1800.0;
/// A forecast is of one machine: time is asked for four times over.
constexpr double kSlack = 4.0;
constexpr std::uint64_t kLeastMinutes = 10;

std::uint64_t mebibytes_of(std::uint64_t bytes) {
  return (bytes + kMiB - 1) / kMiB;
}

/// What to ask for so that so much is inside.
std::uint64_t asked_for(std::uint64_t inside) {
  const std::uint64_t asked = ((inside + kParent) * 10 + 8) / 9;
  return std::max((asked + 127) / 128 * 128, kSmallestTask);
}

/// The next of 1, 1.5, 2, 3, 4, 6, 8... GiB, so that huge scans make few arrays.
std::uint64_t size_class(std::uint64_t mebibytes) {
  std::uint64_t step = 1024;
  while (step < mebibytes) {
    if (step + step / 2 >= mebibytes) {
      return step + step / 2;
    }
    step *= 2;
  }
  return step;
}

/// Of the kind of node that most processors belong to.
std::uint64_t share_of_processor(const SlurmSite& site) {
  const auto most = std::ranges::max_element(site.nodes, {}, [](const SlurmNodes& kind) {
    return std::uint64_t{kind.count} * kind.processors;
  });
  return most == site.nodes.end() || most->processors == 0 || most->mebibytes < 512
             ? kUsualShare
             : std::min(most->mebibytes / most->processors, kUsualShare);
}

/// How many such tasks the nodes hold at once; 0 where not known.
std::uint64_t places(const SlurmSite& site, const TaskArray& array) {
  std::uint64_t sum = 0;
  for (const SlurmNodes& kind : site.nodes) {
    std::uint64_t each = kind.processors / array.processors;
    if (array.mebibytes > 0) {
      each = std::min(each, kind.mebibytes / array.mebibytes);
    }
    sum += kind.count * each;
  }
  return sum;
}

void check_room(const SlurmSite& site, std::uint32_t processors, std::uint64_t mebibytes) {
  if (!site.has_room_for(processors, mebibytes)) {
    throw UsageError(fmt::format(
        "No node of the partition {} has room for a task of {} processors and {} MiB: the largest "
        "have {} processors and {} MiB. Ask for less with --cpus-per-task and --mem, or give "
        "another --partition.",
        site.partition, processors, mebibytes, site.most_processors(), site.most_memory()));
  }
}

std::uint64_t minutes_for(double seconds, const TaskWishes& wishes, const SlurmSite& site) {
  if (wishes.minutes > 0) {
    return wishes.minutes;
  }
  const auto slack = static_cast<std::uint64_t>(std::ceil(seconds * kSlack / 60.0));
  const std::uint64_t minutes = (slack + kLeastMinutes + 4) / 5 * 5;
  return std::max<std::uint64_t>(std::min(minutes, site.most_minutes.value_or(minutes)), 1);
}

/// Deals the scans of the array out to its tasks and foresees how long they take.
void deal_out(std::span<const TaskScan> scans, const TaskWishes& wishes, const SlurmSite& site,
              TaskArray& array) {
  std::vector<double> costs;
  for (const std::uint32_t scan : array.scans) {
    costs.push_back(scans[scan].cpu_seconds);
  }
  array.task = pack(costs, array.tasks);
  std::vector<double> seconds(array.tasks, 0.0);
  for (std::size_t k = 0; k < costs.size(); ++k) {
    seconds[array.task[k]] += costs[k] / array.processors;
  }
  array.longest_seconds = std::ranges::max(seconds);
  array.shortest_seconds = std::ranges::min(seconds);
  array.minutes = minutes_for(array.longest_seconds, wishes, site);
}

std::uint32_t tasks_for(std::span<const TaskScan> scans, const TaskWishes& wishes,
                        const SlurmSite& site, const TaskArray& array) {
  const std::size_t most = array.scans.size();
  if (wishes.tasks > 0) {
    return static_cast<std::uint32_t>(std::min<std::size_t>(wishes.tasks, most));
  }
  double seconds = 0.0;
  for (const std::uint32_t scan : array.scans) {
    seconds += scans[scan].cpu_seconds / array.processors;
  }
  // Two for each place even out what the forecast got wrong.
  const std::uint64_t at_hand = std::max<std::uint64_t>(2 * places(site, array), 16);
  const double wanted =
      std::max(seconds / kLongTask, std::min(static_cast<double>(at_hand), seconds / kShortTask));
  const double limit = static_cast<double>(std::min<std::size_t>(most, site.most_tasks));
  return static_cast<std::uint32_t>(std::clamp(std::ceil(wanted), 1.0, limit));
}

TaskArray common_array(std::span<const TaskScan> scans, std::vector<std::uint32_t> members,
                       const TaskWishes& wishes, const SlurmSite& site, std::uint64_t limit,
                       std::uint32_t processors) {
  TaskArray array;
  array.name = "scans";
  array.scans = std::move(members);
  array.processors = processors;
  if (wishes.mebibytes) {
    array.mebibytes = *wishes.mebibytes;
  } else {
    // Room for the largest, one a processor.
    std::vector<std::uint64_t> needs;
    for (const std::uint32_t scan : array.scans) {
      needs.push_back(mebibytes_of(scans[scan].good_memory));
    }
    std::ranges::sort(needs, std::greater());
    needs.resize(std::min<std::size_t>(needs.size(), processors));
    const auto together = std::accumulate(needs.begin(), needs.end(), std::uint64_t{0});
    array.mebibytes = std::max(std::min(asked_for(together), limit), asked_for(needs.front()));
  }
  array.tasks = tasks_for(scans, wishes, site, array);
  deal_out(scans, wishes, site, array);
  return array;
}

/// Fewer processors, then less memory, until a node has room.
void fit_large(const SlurmSite& site, const TaskWishes& wishes, TaskArray& array) {
  while (wishes.processors == 0 && array.processors > 1 &&
         !site.has_room_for(array.processors, array.mebibytes)) {
    --array.processors;
  }
  if (!site.has_room_for(array.processors, array.mebibytes)) {
    // A scan makes do with less memory than it would like, and says so where it can't.
    array.mebibytes = 0;
    for (const SlurmNodes& kind : site.nodes) {
      if (kind.processors >= array.processors) {
        array.mebibytes =
            std::max(array.mebibytes,
                     std::min(kind.mebibytes, site.most_mebibytes.value_or(kind.mebibytes)));
      }
    }
  }
}

}  // namespace

std::vector<TaskArray> plan_tasks(std::span<const TaskScan> scans, const TaskWishes& wishes,
                                  const SlurmSite& site) {
  std::uint32_t processors = wishes.processors > 0 ? wishes.processors : kProcessors;
  if (wishes.processors == 0 && site.most_processors() > 0) {
    processors = std::min(processors, site.most_processors());
  }
  check_room(site, processors, wishes.mebibytes.value_or(0));
  const std::uint64_t limit =
      wishes.mebibytes.value_or(std::max(processors * share_of_processor(site), kSmallestTask));
  // All of a node is enough for whatever there is.
  const bool unlimited = wishes.mebibytes && *wishes.mebibytes == 0;

  std::vector<std::uint32_t> common;
  std::map<std::uint64_t, std::vector<std::uint32_t>> large;
  for (std::uint32_t k = 0; k < scans.size(); ++k) {
    const std::uint64_t good = asked_for(mebibytes_of(scans[k].good_memory));
    if (unlimited || good <= limit) {
      common.push_back(k);
    } else {
      large[wishes.mebibytes ? limit : size_class(good)].push_back(k);
    }
  }

  std::vector<TaskArray> arrays;
  for (auto& [mebibytes, members] : large) {
    TaskArray array;
    array.processors = wishes.processors > 0 ? wishes.processors : kProcessorsOfLarge;
    array.mebibytes = mebibytes;
    array.name = fmt::format("large-{}M", mebibytes);
    if (mebibytes % 1024 == 0) {
      array.name = fmt::format("large-{}G", mebibytes / 1024);
    }
    array.scans = std::move(members);
    array.tasks = static_cast<std::uint32_t>(array.scans.size());
    fit_large(site, wishes, array);
    deal_out(scans, wishes, site, array);
    arrays.push_back(std::move(array));
  }
  // What takes longest is submitted first.
  std::ranges::reverse(arrays);
  if (!common.empty()) {
    arrays.push_back(common_array(scans, std::move(common), wishes, site, limit, processors));
  }
  return arrays;
}

std::vector<std::uint32_t> array_sizes(std::uint32_t tasks, std::uint32_t most) {
  std::vector<std::uint32_t> sizes;
  const std::uint32_t arrays = (tasks + most - 1) / most;
  for (std::uint32_t k = 0; k < arrays; ++k) {
    // Evenly: no array of a single task at the end.
    sizes.push_back(tasks / arrays + (k < tasks % arrays ? 1U : 0U));
  }
  return sizes;
}

std::uint64_t warning_seconds(std::uint64_t minutes) {
  return std::min<std::uint64_t>(60, minutes * 15);
}

}  // namespace rattan
