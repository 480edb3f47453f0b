// SPDX-License-Identifier: MIT
#include "jobs/slurm/job_script.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "jobs/version.h"

namespace rattan {

namespace {

// What follows is bash, also that of ten years ago: an empty array under `set -u` is an error
// there, so words that may be none are positional parameters.
constexpr std::string_view kTaskBody = R"BASH(
# The number of the task among all of this kind: the argument counts those of the arrays before.
shard=$((SLURM_ARRAY_TASK_ID + ${1:-0}))
task="${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
restarts=${SLURM_RESTART_COUNT:-0}
# Builtins alone: bash 5.2 may fail where a trap that substitutes a command interrupts another one.
say() { printf '%(%F %T)T task %s on %s: %s\n' -1 "$task" "${SLURMD_NODENAME:-$HOSTNAME}" "$*"; }

# Nine tenths of the memory that Slurm granted (MiB); the rest is for what it counts besides.
granted=${SLURM_MEM_PER_NODE:-$((${SLURM_MEM_PER_CPU:-0} * ${SLURM_CPUS_ON_NODE:-1}))}
set -- --threads "${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}"
if [ "$granted" -gt 0 ]; then
  set -- "$@" --memory "$((granted * 9 / 10))MiB"
fi

# The early warning of a time limit or of preemption reaches this shell alone, so it is passed on.
# SIGTERM reaches every process of the job; what comes after it is Slurm's decision.
program=
signalled=
warned=
ended=
trap 'signalled=1; warned=1; say "told to stop soon"; [ -z "$program" ] || kill -USR1 "$program" || true' USR1
trap 'signalled=1; ended=1; say "told to stop now"' TERM

say "shard $shard of $tasks, start $((restarts + 1))"
)BASH";

constexpr std::string_view kTaskEnd = R"BASH(program=$!
[ -z "$warned" ] || kill -USR1 "$program" || true
while true; do
  signalled=
  code=0
  wait "$program" || code=$?
  [ -n "$signalled" ] || break  # else it was the wait that ended, not the program
done
if [ "$code" -eq 138 ]; then
  code=75  # warned before it had begun
elif [ "$code" -gt 127 ]; then
  say "rattan was killed ($code)"
  code=1  # Slurm keeps codes up to 127
fi

# 75: stopped with its work saved. Another turn for this task alone: never by SLURM_JOB_ID, which is
# the whole array's in its last task. Nor after SIGTERM: who cancels a task wants it to end.
if [ "$code" -eq 75 ] && [ -z "$ended" ]; then
  if [ "$restarts" -ge "$most_restarts" ]; then
    say "started $((restarts + 1)) times, and not again"
  else
    say "asks for another turn"
    if scontrol requeue "$task"; then
      sleep 600 &
      wait "$!" || true  # until Slurm ends this one
    fi
  fi
fi
say "ends with code $code"
exit "$code"
)BASH";

bool is_plain(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_-.,:@%/+=").find(c) != std::string_view::npos;
  });
}

/// sbatch reads these lines by rules of its own: only what needs no quotes goes there.
std::string directive(const std::string& option, const std::string& value) {
  if (!is_plain(value)) {
    throw UsageError(fmt::format("--{} {}: not a name that Slurm takes.", option, value));
  }
  return fmt::format("#SBATCH --{}={}\n", option, value);
}

std::string directives(const ScriptSettings& settings, std::uint32_t processors,
                       std::uint64_t mebibytes, std::uint64_t minutes) {
  std::string text = "#!/bin/bash\n";
  for (const auto& [option, value] :
       {std::pair("partition", &settings.partition), std::pair("account", &settings.account),
        std::pair("qos", &settings.qos)}) {
    if (!value->empty()) {
      text += directive(option, *value);
    }
  }
  text += "#SBATCH --nodes=1\n#SBATCH --ntasks=1\n";
  text += directive("cpus-per-task", std::to_string(processors));
  text += directive("mem", mebibytes == 0 ? "0" : fmt::format("{}M", mebibytes));
  text += directive("time", slurm_time(minutes));
  text += "#SBATCH --requeue\n#SBATCH --open-mode=append\n";
  return text;
}

std::string written_by() {
  return fmt::format("rattan {} ({})", version(), commit());
}

/// As --output wants it: a percent sign in a name is none of Slurm's own.
std::string log_folder(const std::string& directory) {
  std::string text;
  for (const char c : directory) {
    text.append(c == '%' ? 2 : 1, c);
  }
  return text + "/.rattan/slurm/logs";
}

std::string many(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

std::string shell_quoted(const std::string& text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  const bool ansi = std::ranges::any_of(text, control);
  std::string quoted = ansi ? "$'" : "'";
  for (const char c : text) {
    if (!ansi && c == '\'') {
      quoted += "'\\''";
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (control(c)) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      if (ansi && (c == '\'' || c == '\\')) {
        quoted.push_back('\\');
      }
      quoted.push_back(c);
    }
  }
  quoted.push_back('\'');
  return quoted;
}

std::string command_line(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    text +=
        fmt::format("{}{}", text.empty() ? "" : " ", is_plain(word) ? word : shell_quoted(word));
  }
  return text;
}

std::string task_script(const TaskArray& array, const ScriptSettings& settings) {
  std::string text = directives(settings, array.processors, array.mebibytes, array.minutes);
  text += directive("job-name", "rattan");
  text += fmt::format("#SBATCH --signal=B:USR1@{}\n", warning_seconds(array.minutes));
  text += fmt::format(
      "# One task of {}: {} of {}.jsonl, as far as they aren't done yet, however often\n"
      "# it is started. Written by {}; submit.sh submits it.\n"
      "set -euo pipefail\n\n",
      array.tasks, many(array.scans.size(), "scan"), array.name, written_by());
  text += fmt::format("rattan={}\ndirectory={}\nmanifest={}\ntasks={}\nmost_restarts=100\n",
                      shell_quoted(settings.program), shell_quoted(settings.directory),
                      shell_quoted(fmt::format("{}/{}.jsonl", settings.folder, array.name)),
                      array.tasks);
  text += kTaskBody;
  text += fmt::format(
      "\"$rattan\" batch \"$manifest\" -o \"$directory\" --shard \"$shard/$tasks\"{}{} "
      "\"$@\" &\n",
      settings.batch_words.empty() ? "" : " ", command_line(settings.batch_words));
  text += kTaskEnd;
  return text;
}

std::string merge_script(const ScriptSettings& settings) {
  std::string text = directives(settings, 1, 1024, settings.merge_minutes);
  text += directive("job-name", "rattan-merge");
  text += fmt::format(
      "# Runs when every task has ended, however it did. Written by {}.\nset -euo pipefail\n\n"
      "rattan={}\ndirectory={}\n\n",
      written_by(), shell_quoted(settings.program), shell_quoted(settings.directory));
  text += "\"$rattan\" batch --report \"$directory\"\n";
  text +=
      "# Scans that are neither done nor failed are listed, with the command to go on: code 75.\n";
  text += "exec \"$rattan\" slurm --check \"$directory\"\n";
  return text;
}

std::string submit_script(const std::vector<TaskArray>& arrays, const ScriptSettings& settings) {
  std::uint64_t scans = 0;
  std::uint64_t tasks = 0;
  for (const TaskArray& array : arrays) {
    scans += array.scans.size();
    tasks += array.tasks;
  }
  std::string text = "#!/bin/bash\n";
  text +=
      fmt::format("# Submits {} in {}, and the merge that writes the report.\n# Written by {}.\n",
                  many(scans, "scan"), many(tasks, "task"), written_by());
  text += fmt::format("set -euo pipefail\ncd {}\nlogs={}\n", shell_quoted(settings.folder),
                      shell_quoted(log_folder(settings.directory)));
  text += R"BASH(if [ -e jobs ]; then
  echo "Submitted already:" >&2
  cat jobs >&2
  exit 2
fi
after=
# submit LOG NAME FIRST OPTION...: FIRST is how many of the tasks are in arrays before this one.
submit() {
  local log=$1 name=$2 first=$3 id
  shift 3
  id=$(sbatch --parsable --output="$logs/$log" "$@" "$name.sh" "$first")
  id=${id%%;*}  # sites of several clusters add a name
  echo "$name $first $id" | tee -a jobs
  after=$after:$id
}
)BASH";
  const std::string more =
      settings.sbatch_words.empty() ? "" : fmt::format(" {}", command_line(settings.sbatch_words));
  const std::string throttle = settings.at_once == 0 ? "" : fmt::format("%{}", settings.at_once);
  for (const TaskArray& array : arrays) {
    std::uint32_t first = 0;
    for (const std::uint32_t size : array_sizes(array.tasks, settings.most_tasks)) {
      text += fmt::format("submit %A_%a.log {} {} --array=1-{}{}{}\n", array.name, first, size,
                          throttle, more);
      first += size;
    }
  }
  for (const std::string& job : settings.earlier_jobs) {
    text += fmt::format("after=$after:{}  # of an earlier submission\n", job);
  }
  text +=
      "# afterany: scans that can't be used make their task fail, and belong into the report.\n";
  text += "submit merge_%j.log merge 0 --dependency=\"afterany$after\" --kill-on-invalid-dep=yes" +
          more + "\n";
  return text;
}

}  // namespace rattan
