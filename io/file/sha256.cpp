// SPDX-License-Identifier: MIT
#include "io/file/sha256.h"

#include <algorithm>
#include <bit>
#include <cpuid.h>
#include <cstring>
#include <immintrin.h>

namespace rattan {
namespace {

constexpr std::array<std::uint32_t, 64> kRound{
    0x428a2f98U, 0x71374491U, 0xb5c0fbcfU, 0xe9b5dba5U, 0x3956c25bU, 0x59f111f1U, 0x923f82a4U,
    0xab1c5ed5U, 0xd807aa98U, 0x12835b01U, 0x243185beU, 0x550c7dc3U, 0x72be5d74U, 0x80deb1feU,
    0x9bdc06a7U, 0xc19bf174U, 0xe49b69c1U, 0xefbe4786U, 0x0fc19dc6U, 0x240ca1ccU, 0x2de92c6fU,
    0x4a7484aaU, 0x5cb0a9dcU, 0x76f988daU, 0x983e5152U, 0xa831c66dU, 0xb00327c8U, 0xbf597fc7U,
    0xc6e00bf3U, 0xd5a79147U, 0x06ca6351U, 0x14292967U, 0x27b70a85U, 0x2e1b2138U, 0x4d2c6dfcU,
    0x53380d13U, 0x650a7354U, 0x766a0abbU, 0x81c2c92eU, 0x92722c85U, 0xa2bfe8a1U, 0xa81a664bU,
    0xc24b8b70U, 0xc76c51a3U, 0xd192e819U, 0xd6990624U, 0xf40e3585U, 0x106aa070U, 0x19a4c116U,
    0x1e376c08U, 0x2748774cU, 0x34b0bcb5U, 0x391c0cb3U, 0x4ed8aa4aU, 0x5b9cca4fU, 0x682e6ff3U,
    0x748f82eeU, 0x78a5636fU, 0x84c87814U, 0x8cc70208U, 0x90befffaU, 0xa4506cebU, 0xbef9a3f7U,
    0xc67178f2U};

std::uint32_t load_big(const std::uint8_t* p) {
  std::uint32_t word;
  std::memcpy(&word, p, 4);
  return __builtin_bswap32(word);
}

// SSE4.1 (leaf 1, ECX bits 9 and 19) and the SHA extensions (leaf 7, EBX bit 29).
bool has_sha_instructions() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c >> 9 & 1U) == 0 || (c >> 19 & 1U) == 0) {
    return false;
  }
  return __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (b >> 29 & 1U) != 0;
}

// The processor's own rounds, five times as fast. It keeps the state as (a, b, e, f), (c, d, g, h).
__attribute__((target("sha,sse4.1"))) void compress_in_hardware(std::array<std::uint32_t, 8>& words,
                                                                const std::uint8_t* block,
                                                                std::size_t blocks) {
  const __m128i big = _mm_set_epi64x(0x0c0d0e0f08090a0bLL, 0x0405060700010203LL);
  auto* const state = reinterpret_cast<__m128i*>(words.data());
  const __m128i badc = _mm_shuffle_epi32(_mm_loadu_si128(state), 0xb1);
  const __m128i hgfe = _mm_shuffle_epi32(_mm_loadu_si128(state + 1), 0x1b);
  __m128i abef = _mm_alignr_epi8(badc, hgfe, 8);
  __m128i cdgh = _mm_blend_epi16(hgfe, badc, 0xf0);
  for (; blocks > 0; --blocks, block += 64) {
    const __m128i abef_before = abef;
    const __m128i cdgh_before = cdgh;
    __m128i w[4];
#pragma GCC unroll 16
    for (unsigned r = 0; r < 16; ++r) {
      __m128i& now = w[r & 3];
      if (r < 4) {
        const auto* from = reinterpret_cast<const __m128i*>(block + 16 * r);
        now = _mm_shuffle_epi8(_mm_loadu_si128(from), big);
      } else {
        const __m128i last = w[(r + 3) & 3];
        const __m128i seven_back = _mm_alignr_epi8(last, w[(r + 2) & 3], 4);
        now = _mm_add_epi32(_mm_sha256msg1_epu32(now, w[(r + 1) & 3]), seven_back);
        now = _mm_sha256msg2_epu32(now, last);
      }
      const auto* constants = reinterpret_cast<const __m128i*>(kRound.data() + 4 * r);
      const __m128i wk = _mm_add_epi32(now, _mm_loadu_si128(constants));
      cdgh = _mm_sha256rnds2_epu32(cdgh, abef, wk);
      abef = _mm_sha256rnds2_epu32(abef, cdgh, _mm_shuffle_epi32(wk, 0x0e));
    }
    abef = _mm_add_epi32(abef, abef_before);
    cdgh = _mm_add_epi32(cdgh, cdgh_before);
  }
  const __m128i feba = _mm_shuffle_epi32(abef, 0x1b);
  const __m128i dchg = _mm_shuffle_epi32(cdgh, 0xb1);
  _mm_storeu_si128(state, _mm_blend_epi16(feba, dchg, 0xf0));
  _mm_storeu_si128(state + 1, _mm_alignr_epi8(dchg, feba, 8));
}

}  // namespace

Sha256::Sha256() : in_hardware_(has_sha_instructions()) {}

void Sha256::compress(const std::uint8_t* block, std::size_t blocks) {
  if (in_hardware_) {
    compress_in_hardware(state_, block, blocks);
    return;
  }
  auto [a0, b0, c0, d0, e0, f0, g0, h0] = state_;
  for (; blocks > 0; --blocks, block += 64) {
    std::uint32_t w[16];
    std::uint32_t a = a0, b = b0, c = c0, d = d0, e = e0, f = f0, g = g0, h = h0;
    const auto round = [&](std::uint32_t wk) {
      const std::uint32_t s1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
      const std::uint32_t t1 = h + s1 + (g ^ (e & (f ^ g))) + wk;
      const std::uint32_t s0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
      const std::uint32_t t2 = s0 + ((a & b) | (c & (a | b)));
      h = g;
      g = f;
      f = e;
      e = d + t1;
      d = c;
      c = b;
      b = a;
      a = t1 + t2;
    };
#pragma GCC unroll 16
    for (unsigned i = 0; i < 16; ++i) {
      w[i] = load_big(block + 4 * i);
      round(w[i] + kRound[i]);
    }
    for (unsigned r = 16; r < 64; r += 16) {
#pragma GCC unroll 16
      for (unsigned i = 0; i < 16; ++i) {
        const std::uint32_t w15 = w[(i + 1) & 15];
        const std::uint32_t w2 = w[(i + 14) & 15];
        w[i] += (std::rotr(w15, 7) ^ std::rotr(w15, 18) ^ (w15 >> 3)) + w[(i + 9) & 15] +
                (std::rotr(w2, 17) ^ std::rotr(w2, 19) ^ (w2 >> 10));
        round(w[i] + kRound[r + i]);
      }
    }
    a0 += a;
    b0 += b;
    c0 += c;
    d0 += d;
    e0 += e;
    f0 += f;
    g0 += g;
    h0 += h;
  }
  state_ = {a0, b0, c0, d0, e0, f0, g0, h0};
}

void Sha256::update(std::span<const std::byte> bytes) {
  const auto* p = reinterpret_cast<const std::uint8_t*>(bytes.data());
  std::size_t n = bytes.size();
  total_bytes_ += n;
  if (pending_bytes_ > 0) {
    const std::size_t take = std::min(n, pending_.size() - pending_bytes_);
    std::copy_n(p, take, pending_.begin() + static_cast<std::ptrdiff_t>(pending_bytes_));
    pending_bytes_ += take;
    p += take;
    n -= take;
    if (pending_bytes_ < pending_.size()) {
      return;
    }
    compress(pending_.data(), 1);
    pending_bytes_ = 0;
  }
  compress(p, n / 64);
  pending_bytes_ = n % 64;
  std::copy_n(p + (n - pending_bytes_), pending_bytes_, pending_.begin());
}

std::array<std::uint8_t, 32> Sha256::digest() {
  const std::uint64_t bits = total_bytes_ * 8;
  std::array<std::uint8_t, 128> tail{};
  std::copy_n(pending_.begin(), pending_bytes_, tail.begin());
  tail[pending_bytes_] = 0x80;
  const std::size_t blocks = pending_bytes_ < 56 ? 1 : 2;
  for (unsigned i = 0; i < 8; ++i) {
    tail[64 * blocks - 1 - i] = static_cast<std::uint8_t>(bits >> (8 * i));
  }
  compress(tail.data(), blocks);
  std::array<std::uint8_t, 32> out{};
  for (unsigned i = 0; i < 32; ++i) {
    out[i] = static_cast<std::uint8_t>(state_[i / 4] >> (24 - 8 * (i % 4)));
  }
  return out;
}

std::string Sha256::hex_digest() {
  static constexpr char kDigit[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : digest()) {
    text += kDigit[byte >> 4];
    text += kDigit[byte & 15];
  }
  return text;
}

}  // namespace rattan
