// SPDX-License-Identifier: MIT
#include "jobs/slurm/job_script.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "jobs/slurm/command_output.h"

namespace rattan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ScriptSettings settings_for(const std::string& directory) {
  ScriptSettings settings;
  settings.program = "/opt/rattan/bin/rattan";
  settings.directory = directory;
  settings.folder = directory + "/.rattan/slurm/1";
  return settings;
}

TaskArray array_of(std::uint32_t scans, std::uint32_t tasks) {
  TaskArray array;
  array.name = "scans";
  array.scans.resize(scans);
  array.tasks = tasks;
  array.processors = 4;
  array.mebibytes = 2048;
  array.minutes = 90;
  return array;
}

TEST(JobScript, QuotedTextComesBack) {
  for (const std::string& text :
       {std::string("plain"), std::string(), std::string("/it's \"odd\"\n$HOME `date` \\ %a *\t#"),
        std::string("'"), std::string("\\'\n"), std::string("a\x01z\x7F"),
        std::string("caf\xC3\xA9 \xFF\n"), std::string("$'x'")}) {
    EXPECT_EQ(run_command({"bash", "-c", "printf %s " + shell_quoted(text)}).out, text);
  }
  EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_quoted("a\nb"), "$'a\\nb'");
}

TEST(JobScript, AsksForWhatThePlanSays) {
  ScriptSettings settings = settings_for("/data/out");
  settings.partition = "batch,long";
  settings.account = "geo";
  const std::string script = task_script(array_of(182, 12), settings);
  for (const char* line : {"#SBATCH --partition=batch,long\n", "#SBATCH --account=geo\n",
                           "#SBATCH --cpus-per-task=4\n", "#SBATCH --mem=2048M\n",
                           "#SBATCH --time=01:30:00\n", "#SBATCH --signal=B:USR1@60\n",
                           "#SBATCH --requeue\n", "#SBATCH --open-mode=append\n", "\ntasks=12\n"}) {
    EXPECT_THAT(script, HasSubstr(line));
  }
  EXPECT_THAT(script, Not(HasSubstr("--qos")));
  EXPECT_THAT(script, HasSubstr("manifest='/data/out/.rattan/slurm/1/scans.jsonl'\n"));
  // By the array's id and the task's number alone.
  EXPECT_THAT(script, Not(HasSubstr("$SLURM_JOB_ID")));
}

TEST(JobScript, NamesThatSlurmWouldMisreadAreRefused) {
  ScriptSettings settings = settings_for("/data/out");
  settings.account = "a b";
  EXPECT_THROW(task_script(array_of(1, 1), settings), UsageError);
  settings.account = "x\n#SBATCH --wrap=rm";
  EXPECT_THROW(merge_script(settings), UsageError);
}

TEST(JobScript, ManyTasksAreSeveralArrays) {
  ScriptSettings settings = settings_for("/data/out");
  settings.most_tasks = 1000;
  settings.at_once = 20;
  settings.sbatch_words = {"--constraint=a b"};
  settings.earlier_jobs = {"17"};
  const std::string script = submit_script({array_of(9000, 2500)}, settings);
  EXPECT_THAT(script, HasSubstr("submit %A_%a.log scans 0 --array=1-834%20 '--constraint=a b'\n"));
  EXPECT_THAT(script,
              HasSubstr("submit %A_%a.log scans 834 --array=1-833%20 '--constraint=a b'\n"));
  EXPECT_THAT(script,
              HasSubstr("submit %A_%a.log scans 1667 --array=1-833%20 '--constraint=a b'\n"));
  EXPECT_THAT(script, HasSubstr("after=$after:17"));
}

/// The scripts, run with stand-ins for rattan and Slurm, in a folder of an odd name.
class JobScriptRun : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = std::filesystem::temp_directory_path() / "rattan-test.XXXXXX";
    root_ = ::mkdtemp(name.data());
    settings_ = settings_for((root_ / "it's \"odd\" $HOME \\ %a\n*").string());
    std::filesystem::create_directories(settings_.folder);
    file("scontrol", "#!/bin/bash\necho \"$*\" >> \"$0.said\"\n");
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  std::string file(const std::string& name, const std::string& text) {
    const std::filesystem::path path = root_ / name;
    std::ofstream(path) << text;
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path.string();
  }

  /// A stand-in for rattan that tells its arguments and does what `then` says.
  void rattan_does(const std::string& then) {
    settings_.program =
        file("rattan", "#!/bin/bash\nprintf '%s|' \"$@\" >> \"$0.said\"\n" + then + '\n');
  }

  std::string said_by(const std::string& name) {
    std::ifstream stream(root_ / (name + ".said"));
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// Task 2 of array 40, which is its last: its job id is the array's. `setup` runs before, in the
  /// process that becomes the task.
  CommandOutput task(const std::string& setup = "", const std::string& argument = "") {
    const std::string script = file("scans.sh", task_script(array_of(9, 3), settings_));
    return run_command({"bash", "-c",
                        "export SLURM_ARRAY_JOB_ID=40 SLURM_ARRAY_TASK_ID=2 SLURM_JOB_ID=40 "
                        "SLURM_CPUS_PER_TASK=4 PATH=" +
                            root_.string() + ":$PATH\n" + setup + "\nexec bash " + script + ' ' +
                            argument});
  }

  std::filesystem::path root_;
  ScriptSettings settings_;
};

TEST_F(JobScriptRun, ShellcheckFindsNothing) {
  if (run_command({"shellcheck", "--version"}).code != 0) {
    GTEST_SKIP() << "shellcheck isn't installed";
  }
  settings_.sbatch_words = {"--mail-type=END"};
  settings_.batch_words = {"--retry-failed"};
  const CommandOutput found =
      run_command({"shellcheck", file("scans.sh", task_script(array_of(9, 3), settings_)),
                   file("merge.sh", merge_script(settings_)),
                   file("submit.sh", submit_script({array_of(9, 3), array_of(2, 2)}, settings_))});
  EXPECT_EQ(found.code, 0) << found.out;
}

TEST_F(JobScriptRun, ATaskRunsItsShard) {
  rattan_does("exit 0");
  settings_.batch_words = {"--retry-failed"};
  const CommandOutput done = task("export SLURM_MEM_PER_NODE=2000");
  EXPECT_EQ(done.code, 0) << done.error;
  EXPECT_EQ(said_by("rattan"), "batch|" + settings_.folder + "/scans.jsonl|-o|" +
                                   settings_.directory +
                                   "|--shard|2/3|--retry-failed|--threads|4|--memory|1800MiB|");
  EXPECT_EQ(said_by("scontrol"), "");
}

TEST_F(JobScriptRun, ALaterArrayGoesOnCounting) {
  rattan_does("exit 0");
  task("", "1000");
  EXPECT_THAT(said_by("rattan"), HasSubstr("|--shard|1002/3|"));
  EXPECT_THAT(said_by("rattan"), Not(HasSubstr("--memory")));  // nothing granted, nothing said
}

TEST_F(JobScriptRun, MemoryMayBeGrantedByProcessor) {
  rattan_does("exit 0");
  task("export SLURM_MEM_PER_CPU=1000 SLURM_CPUS_ON_NODE=4");
  EXPECT_THAT(said_by("rattan"), HasSubstr("--memory|3600MiB|"));
}

TEST_F(JobScriptRun, CodesArePassedOn) {
  for (const int code : {1, 3, 4}) {
    rattan_does("exit " + std::to_string(code));
    EXPECT_EQ(task().code, code);
  }
  rattan_does("kill -KILL $$");
  EXPECT_EQ(task().code, 1);
  EXPECT_EQ(said_by("scontrol"), "");
}

// Slurm ends a task that is requeued; here its wait is ended in Slurm's place.
constexpr const char* kEndTheWait =
    "(until [ -e \"${PATH%%:*}/scontrol.said\" ]; do sleep 0.1; done; sleep 0.2;"
    " pkill -TERM -P $$ -x sleep) >/dev/null 2>&1 &\n";

TEST_F(JobScriptRun, AnInterruptedTaskIsRequeuedAlone) {
  rattan_does("exit 75");
  EXPECT_EQ(task(kEndTheWait).code, 75);
  EXPECT_EQ(said_by("scontrol"), "requeue 40_2\n");
}

TEST_F(JobScriptRun, RequeueingHasAnEnd) {
  rattan_does("exit 75");
  EXPECT_EQ(task("export SLURM_RESTART_COUNT=100").code, 75);
  EXPECT_EQ(said_by("scontrol"), "");
}

TEST_F(JobScriptRun, TheWarningIsPassedOnAndWaitedFor) {
  rattan_does("trap 'sleep 0.5; exit 75' USR1; for k in {1..100}; do sleep 0.1; done; exit 1");
  const CommandOutput done = task(std::string(kEndTheWait) + "(sleep 1; kill -USR1 $$) &");
  EXPECT_EQ(done.code, 75) << done.out << done.error;
  EXPECT_EQ(said_by("scontrol"), "requeue 40_2\n");
}

TEST_F(JobScriptRun, ACancelledTaskIsNotRequeued) {
  rattan_does("trap 'sleep 0.5; exit 75' TERM; for k in {1..100}; do sleep 0.1; done; exit 1");
  const CommandOutput done = task("(sleep 1; kill -TERM $$; pkill -TERM -P $$ -x rattan) &");
  EXPECT_EQ(done.code, 75) << done.out << done.error;
  EXPECT_EQ(said_by("scontrol"), "");
}

TEST_F(JobScriptRun, SubmittingTellsTheMergeWhatToWaitFor) {
  file("sbatch",
       "#!/bin/bash\nprintf '%s|' \"$@\" >> \"$0.said\"\necho >> \"$0.said\"\n"
       "echo >> \"$0.calls\"\necho \"$(wc -l < \"$0.calls\");cluster\"\n");
  settings_.most_tasks = 2;
  const std::string script = file("submit.sh", submit_script({array_of(9, 3)}, settings_));
  const std::string command = "PATH=" + root_.string() + ":$PATH bash " + script;
  const CommandOutput done = run_command({"bash", "-c", command});
  EXPECT_EQ(done.code, 0) << done.error;
  EXPECT_EQ(done.out, "scans 0 1\nscans 2 2\nmerge 0 3\n");
  // Where the folder has a percent sign, Slurm is told that it means just that.
  std::string logs = "--parsable|--output=" + settings_.directory + "/.rattan/slurm/logs/";
  logs.replace(logs.find('%'), 1, "%%");
  const std::string task = logs + "%A_%a.log|";
  EXPECT_EQ(said_by("sbatch"),
            task + "--array=1-2|scans.sh|0|\n" + task + "--array=1-1|scans.sh|2|\n" + logs +
                "merge_%j.log|--dependency=afterany:1:2|--kill-on-invalid-dep=yes|merge.sh|0|\n");
  EXPECT_EQ(run_command({"bash", "-c", command}).code, 2);  // once is enough
}

}  // namespace
}  // namespace rattan
