// From an effect file's text to its description, and the description's simple values.
#include <cctype>

#include "effect/header_parts.hpp"
#include "effect/sloppy_json.hpp"
#include "strict_json.hpp"

namespace brume {

using json = nlohmann::json;

int lineAt(const std::string& text, size_t place) {
    return 1 + int(std::count(text.begin(), text.begin() + std::min(place, text.size()), '\n'));
}

// The JSON sits in the first comment that begins with a brace; the GLSL is everything after it. The comment
// comes back as it lies in the file, blank up to the brace.
std::pair<std::string, size_t> splitComment(const std::string& path, const std::string& text) {
    size_t begin = text.find("/*");
    if (begin == std::string::npos)
        failUsage(path,
                  ": no /* { ... } */ comment at the top; an ISF file begins with its JSON description");
    while (begin != std::string::npos) {
        const size_t end = text.find("*/", begin + 2);
        if (end == std::string::npos)
            failUsage(path, ":", lineAt(text, begin), ": the comment is never closed");
        const size_t brace = text.find_first_not_of(" \t\r\n", begin + 2);
        if (text[brace] == '{') {
            std::string comment = text.substr(0, end);
            for (size_t k = 0; k < brace; k++)
                if (comment[k] != '\n') comment[k] = ' ';
            return {comment, end + 2};
        }
        begin = text.find("/*", end);
    }
    failUsage(path, ": no comment holds a JSON object { ... }; an ISF file begins with its JSON description");
}

// The description, as JSON or, in a foreign file, as what it evidently means.
json parseDescription(const std::string& path, const std::string& fileText, const std::string& comment) {
    try {
        return parseJson(comment);
    } catch (const Error& error) {
        // A foreign file may say a key twice; how deep it may go has no exception.
        const json loose = parseLooseJson(comment);
        if (loose.is_object() && !loose.contains("SPACE")) return loose;
        failUsage(path, ": the description ", error.what());
    } catch (const json::parse_error& error) {
        const json repaired = parseLooseJson(repairJson(comment));
        if (repaired.is_object() && !repaired.empty() && !repaired.contains("SPACE")) return repaired;
        const std::string what = reasonOf(error);  // "parse error at line 6, column 10: what is wrong"
        const size_t place = what.find(", column"), reason = what.find(": ", place);
        failUsage(path, ":", lineAt(fileText, error.byte), ": the description is not JSON: ",
                  reason == std::string::npos ? what : what.substr(reason + 2));
    }
}

std::string nameOf(const json& object, const char* key, const Where& where) {
    const std::string name = textOf(object, key, where);
    if (name.size() > longestName)
        where.fail("a ", key, " of ", name.size(), " characters; at most ", longestName);
    return name;
}

void checkCount(const json& list, const char* what, size_t most, const Where& where) {
    if (list.size() > most) where.fail(list.size(), " ", what, "; at most ", most);
}

std::string textOf(const json& object, const char* key, const Where& where) {
    auto found = object.find(key);
    if (found == object.end() || found->is_null()) return {};
    if (found->is_string()) return found->get<std::string>();
    if (!where.strict) return found->dump();
    where.fail(key, " must be text");
}

bool isTrueWord(std::string word) {
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    return word == "1" || word == "true" || word == "yes";
}

bool flagOf(const json& object, const char* key) {
    auto found = object.find(key);
    if (found == object.end()) return false;
    if (found->is_boolean()) return found->get<bool>();
    if (found->is_number()) return found->get<double>() != 0;
    return found->is_string() && isTrueWord(found->get<std::string>());
}

namespace {

// Foreign files may leave out the dollar of a name.
std::string withDollars(const std::string& expression) {
    const auto isWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    std::string result;
    for (size_t at = 0; at < expression.size();) {
        size_t end = at;
        while (end < expression.size() && isWord(expression[end])) end++;
        const bool isName = end > at && !std::isdigit(static_cast<unsigned char>(expression[at]));
        const auto isCalled = [&] {
            const size_t next = expression.find_first_not_of(" \t\r\n\f\v", end);
            return next != std::string::npos && expression[next] == '(';
        };
        if (isName && !isCalled() && (at == 0 || (expression[at - 1] != '$' && expression[at - 1] != '.')))
            result += '$';
        end = std::max(end, at + 1);
        result += expression.substr(at, end - at);
        at = end;
    }
    return result;
}

}  // namespace

SizeExpression expressionOf(const json& object, const char* key, const Where& where) {
    auto found = object.find(key);
    if (found == object.end() || found->is_null()) return {};
    if (!where.strict && found->is_string() &&
        found->get<std::string>().find_first_not_of(" \t\n") == std::string::npos)
        return {};
    try {
        if (found->is_number()) return SizeExpression(found->dump());
        if (found->is_boolean()) return SizeExpression(found->get<bool>() ? "1" : "0");
        if (found->is_string())
            return SizeExpression(where.strict ? found->get<std::string>()
                                               : withDollars(found->get<std::string>()));
    } catch (const Error& error) {
        where.fail(key, ": ", error.what());
    }
    where.fail(key, " must be a number or a size expression");
}

}  // namespace brume
