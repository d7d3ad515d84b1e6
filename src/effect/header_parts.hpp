// Shared by the files that read effect headers; no one else's business.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "effect/header.hpp"
#include "error.hpp"
#include "nearest_name.hpp"

namespace brume {

// What is being parsed, for messages: "fog.fs: INPUTS[2] 'density'".
struct Where {
    std::string place;
    bool strict;  // brume's own form: unknown keys are mistakes; a foreign ISF file may say what it likes

    Where in(const std::string& part) const { return {place + ": " + part, strict}; }
    template <class... Parts>
    [[noreturn]] void fail(const Parts&... parts) const {
        failUsage(place, ": ", parts...);
    }
    void checkKeys(const nlohmann::json& object, const std::vector<std::string>& known) const {
        if (!strict) return;
        for (const auto& [key, item] : object.items())
            if (std::find(known.begin(), known.end(), key) == known.end())
                fail("unknown key '", key, "'", suggestion(key, known));
    }
};

/// Text, or empty where there is none; a foreign file's other values as JSON.
std::string textOf(const nlohmann::json& object, const char* key, const Where& where);
/// A name that identifiers are made of, each value's among them: of limited length.
std::string nameOf(const nlohmann::json& object, const char* key, const Where& where);
constexpr size_t longestName = 256;
/// Lists that time or memory grow with beyond their own length.
void checkCount(const nlohmann::json& list, const char* what, size_t most, const Where& where);
constexpr size_t mostParameters = 1024, mostPasses = 256, mostValues = 4096, mostFields = 64;
constexpr size_t mostOfChart = 256, mostVariants = 4096;
/// "1", "true" and "yes", in any capitals.
bool isTrueWord(std::string word);
bool flagOf(const nlohmann::json& object, const char* key);
SizeExpression expressionOf(const nlohmann::json& object, const char* key, const Where& where);

Parameter readParameter(const nlohmann::json& object, const Where& outer, bool isField);
/// INPUTS of a foreign file.
std::vector<Parameter> readForeignInputs(const nlohmann::json& inputs, const Where& where);

/// CHART; `header` holds the parameters already.
Chart readChart(const nlohmann::json& object, const EffectHeader& header, const Where& where);

int lineAt(const std::string& text, size_t place);
/// The description's comment and where the GLSL begins.
std::pair<std::string, size_t> splitComment(const std::string& path, const std::string& text);
nlohmann::json parseDescription(const std::string& path, const std::string& fileText,
                                const std::string& comment);

}  // namespace brume
