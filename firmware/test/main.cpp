// Runs the claims. `firmware-tests [word..] [--golden FOLDER] [--fuzz BYTES] [--anarchy TICKS] [--trials N]`: those whose name contains a
// word, or all.

#include <cstdint>
#include <cstdlib>

#include "check.hpp"

int main(int count, char** arguments) {
    std::vector<std::string> words;
    for (int i = 1; i < count; ++i) {
        const std::string word = arguments[i];
        const bool has_value = i + 1 < count;
        if (word == "--golden" && has_value) {
            test::options().golden = arguments[++i];
        } else if (word == "--fuzz" && has_value) {
            test::options().fuzz_bytes = std::strtoull(arguments[++i], nullptr, 10);
        } else if (word == "--anarchy" && has_value) {
            test::options().anarchy = std::strtoul(arguments[++i], nullptr, 10);
        } else if (word == "--trials" && has_value) {
            test::options().trials = std::strtoul(arguments[++i], nullptr, 10);
        } else {
            words.push_back(word);
        }
    }
    int ran = 0;
    int broken = 0;
    for (const test::Claim& claim : test::claims()) {
        bool chosen = words.empty();
        for (const std::string& word : words) {
            chosen = chosen || std::strstr(claim.name, word.c_str()) != nullptr;
        }
        if (!chosen) {
            continue;
        }
        const int before = test::failures();
        claim.run();
        ++ran;
        const bool kept = test::failures() == before;
        broken += kept ? 0 : 1;
        std::printf("%s  %s\n", kept ? "ok    " : "BROKEN", claim.name);
        std::fflush(stdout);
    }
    std::printf("%d claims, %d broken\n", ran, broken);
    return ran == 0 || broken > 0 ? 1 : 0;
}
