// SPDX-License-Identifier: MIT
#include "io/file/sha256.h"

#include <string>

#include <gtest/gtest.h>

namespace rattan {
namespace {

std::string hash(const std::string& text, std::size_t piece = 1U << 20) {
  Sha256 sha;
  for (std::size_t at = 0; at < text.size(); at += piece) {
    sha.update(std::as_bytes(std::span(text).subspan(at, std::min(piece, text.size() - at))));
  }
  return sha.hex_digest();
}

TEST(Sha256, GivesTheStandardVectors) {
  EXPECT_EQ(hash(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(hash("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnop"
                 "jklmnopqklmnopqrlmnopqrsmnopqrstnopqrstu"),
            "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
  EXPECT_EQ(hash(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePieces) {
  std::string text;
  for (int i = 0; i < 300; ++i) {
    text += static_cast<char>(i * 7);
  }
  for (std::size_t length = 0; length <= text.size(); length += 13) {
    const std::string part = text.substr(0, length);
    for (const std::size_t piece : {1U, 3U, 55U, 63U, 64U, 65U, 127U}) {
      EXPECT_EQ(hash(part, piece), hash(part));
    }
  }
}

TEST(Sha256, PlainCodeGivesTheSameAsTheProcessor) {
  std::string text;
  for (int i = 0; i < 1000; ++i) {
    text += static_cast<char>(i * i * 31 + i);
    Sha256 usual;
    Sha256 plain{Sha256::Plain()};
    usual.update(std::as_bytes(std::span(text)));
    plain.update(std::as_bytes(std::span(text)));
    ASSERT_EQ(usual.hex_digest(), plain.hex_digest()) << text.size();
  }
}

}  // namespace
}  // namespace rattan
