// SPDX-License-Identifier: MIT
#include "jobs/scan_token.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/archive.h"
#include "io/file/sha256.h"
#include "jobs/job_steps.h"

namespace rattan {

namespace {

std::string hash_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> block(std::size_t{1} << 20);
  Sha256 hash;
  while (in) {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    hash.update(std::as_bytes(std::span(
        block.data(), static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)))));
  }
  return hash.hex_digest();
}

}  // namespace

InputToken::InputToken(Hdf5Store& store, std::string what, const std::string& path)
    : store_(store), what_("input " + std::move(what)), identity_(file_identity(path)) {
  if (const auto note = store_.note(what_)) {
    std::vector<std::string> known;
    unpack(*note, known);
    known.resize(3);
    if (known[0] == identity_ || (!known[2].empty() && known[2] == hash_of(path))) {
      text_ = known[1];
      sha256_ = known[2];
      save();
      return;
    }
  }
  text_ = identity_;
  save();
}

void InputToken::set_hash(const std::string& sha256) {
  sha256_ = sha256;
  save();
}

void InputToken::save() {
  store_.set_note(what_, pack(std::vector<std::string>{identity_, text_, sha256_}));
}

}  // namespace rattan
