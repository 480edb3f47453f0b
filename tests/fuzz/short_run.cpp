// SPDX-License-Identifier: MIT

// The readers under a fixed sequence of damaged files: `short_run TARGET RUNS` reads every
// truncation and RUNS mutations of that target's seeds; `short_run --seeds FOLDER` writes all seeds
// for libFuzzer, a folder a target.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/fuzz/scan_targets.h"

namespace {

using rattan::fuzz::read_bytes_as;

bool read(const std::string& target, const std::string& bytes) {
  return read_bytes_as(target, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

class Mutator {
 public:
  explicit Mutator(std::vector<std::string> seeds) : seeds_(std::move(seeds)) {}

  std::string next() {
    std::string bytes = pick(seeds_);
    for (std::uint64_t k = random(6) + 1; k > 0; --k) {
      change(bytes);
    }
    return bytes;
  }

 private:
  void change(std::string& bytes) {
    const std::size_t at = random(bytes.size() + 1);
    const std::size_t run = random(8) + 1;
    switch (random(7)) {
      case 0:
        if (at < bytes.size()) {
          bytes[at] = static_cast<char>(random(256));
        }
        break;
      case 1:
        if (at < bytes.size()) {
          bytes[at] = static_cast<char>(bytes[at] ^ (1 << random(8)));
        }
        break;
      case 2:
        bytes.erase(at, run);
        break;
      case 3:
        bytes.insert(at, bytes, random(bytes.size() + 1), run * run);
        break;
      case 4:
        bytes.insert(at, kWords[random(std::size(kWords))]);
        break;
      case 5:
        for (std::size_t k = at; k < std::min(at + run, bytes.size()); ++k) {
          bytes[k] = random(2) == 0 ? '\0' : '\xff';
        }
        break;
      default: {
        const std::string& other = pick(seeds_);
        const std::size_t from = random(other.size());
        bytes = bytes.substr(0, at) + other.substr(from);
        break;
      }
    }
  }
  const std::string& pick(const std::vector<std::string>& from) {
    return from[random(from.size())];
  }
  std::size_t random(std::size_t below) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return below == 0 ? 0 : static_cast<std::size_t>((state_ >> 33) % below);
  }

  static constexpr const char* kWords[] = {
      "-1",   "0", " ", "\n",   "nan", "1e999", "4294967296", "9223372036854775808",
      "\\\n", "#", "/", "list", "\r"};
  std::vector<std::string> seeds_;
  std::uint64_t state_ = 20061;
};

int write_seeds(const std::filesystem::path& folder) {
  for (const std::string& target : rattan::fuzz::scan_targets()) {
    std::filesystem::create_directories(folder / target);
    int number = 0;
    for (const std::string& seed : rattan::fuzz::seeds_of(target)) {
      std::ofstream(folder / target / ("seed" + std::to_string(number++)), std::ios::binary)
          << seed;
    }
  }
  return 0;
}

}  // namespace

int main(int count, char** words) {
  if (count == 3 && std::string(words[1]) == "--seeds") {
    return write_seeds(words[2]);
  }
  const std::vector<std::string> targets = rattan::fuzz::scan_targets();
  if (count != 3 || std::find(targets.begin(), targets.end(), words[1]) == targets.end()) {
    std::fprintf(stderr, "usage: short_run TARGET RUNS | short_run --seeds FOLDER\n");
    return 2;
  }
  const std::string target = words[1];
  const std::vector<std::string> seeds = rattan::fuzz::seeds_of(target);
  long taken = 0;
  for (const std::string& seed : seeds) {
    if (!read(target, seed)) {
      std::fprintf(stderr, "a seed of %s is not read\n", words[1]);
      return 1;
    }
    for (std::size_t length = 0; length < seed.size(); ++length) {
      taken += read(target, seed.substr(0, length)) ? 1 : 0;
    }
  }
  Mutator mutator(seeds);
  const long runs = std::strtol(words[2], nullptr, 10);
  for (long run = 0; run < runs; ++run) {
    taken += read(target, mutator.next()) ? 1 : 0;
  }
  std::printf("%s: %ld mutations, %ld of the damaged files read\n", words[1], runs, taken);
  return 0;
}
