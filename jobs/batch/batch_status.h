// SPDX-License-Identifier: MIT
#pragma once

// `rattan batch --status DIR`: how a batch stands, from any machine that sees its directory, also
// while processes on several machines work on it.

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace rattan {

struct BatchStatus {
  struct Running {
    std::string id;
    std::string host;
    int pid = 0;
    std::string slurm;
    double seconds = 0.0;  ///< so far
    int threads = 0;
  };
  struct Failure {
    std::string id;
    int exit = 0;
    int attempts = 0;
    std::string sentence;
    std::string log;  ///< path
  };
  std::string directory;
  std::uint64_t items = 0;
  std::uint64_t done = 0;
  std::uint64_t interrupted = 0;  ///< to be taken up by the next run
  std::uint64_t pending = 0;      ///< not begun
  std::vector<Running> running;
  std::vector<Failure> failures;      ///< by exit 1, 4, 3, 2, then id
  std::uint64_t processes = 0;        ///< batches at work
  double triangles_per_second = 0.0;  ///< of late
  double scans_per_second = 0.0;
  double seconds_left = -1.0;  ///< below 0: unknown
  double cpu_seconds = 0.0;    ///< of all attempts
};

/// Throws InputError if no batch has ever run there.
BatchStatus read_batch_status(const std::string& directory);
nlohmann::ordered_json to_json(const BatchStatus& status);
/// For people, some lines.
std::string describe(const BatchStatus& status);

}  // namespace rattan
