#include "gl/isf_rewrite.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <vector>

namespace brume {

namespace {

// Words that GLSL 3.30 or a later driver reserves, and that no published shader can mean as keywords.
const std::set<std::string> reserved = {
    "active",    "asm",      "atomic_uint", "buffer",     "cast",      "class",     "coherent",
    "common",    "enum",     "extern",      "external",   "filter",    "fixed",     "fvec2",
    "fvec3",     "fvec4",    "goto",        "half",       "hvec2",     "hvec3",     "hvec4",
    "image1D",   "image2D",  "image3D",     "inline",     "input",     "interface", "long",
    "namespace", "noinline", "output",      "packed",     "partition", "patch",     "precise",
    "public",    "readonly", "resource",    "restrict",   "row_major", "sample",    "shared",
    "short",     "sizeof",   "static",      "subroutine", "superp",    "template",  "this",
    "typedef",   "union",    "unsigned",    "using",      "volatile",  "writeonly", "column_major"};

// Interpolation words, which a shader of the older era may use as names.
const std::set<std::string> interpolation = {"flat", "smooth", "noperspective"};

// GLSL's own functions: an input called `mix` hides that one, where older compilers kept the two apart.
const std::set<std::string> functions = {
    "radians",    "degrees",     "sin",         "cos",     "tan",          "asin",      "acos",
    "atan",       "sinh",        "cosh",        "tanh",    "asinh",        "acosh",     "atanh",
    "pow",        "exp",         "log",         "exp2",    "log2",         "sqrt",      "inversesqrt",
    "abs",        "sign",        "floor",       "trunc",   "round",        "ceil",      "fract",
    "mod",        "modf",        "min",         "max",     "clamp",        "mix",       "step",
    "smoothstep", "isnan",       "isinf",       "length",  "distance",     "dot",       "cross",
    "normalize",  "faceforward", "reflect",     "refract", "outerProduct", "transpose", "determinant",
    "inverse",    "lessThan",    "greaterThan", "equal",   "notEqual",     "any",       "all",
    "not",        "dFdx",        "dFdy",        "fwidth"};

const std::map<std::string, std::string> renamed = {
    {"vv_FragNormCoord", "isf_FragNormCoord"},
    {"vv_vertShaderInit", "isf_vertShaderInit"},
    {"gl_FragColor", "isf_FragColor"},
    {"gl_FragData", "isf_FragData"},
    {"gl_TexCoord", "isf_TexCoord"},
    {"gl_Vertex", "isf_vertex"},
    {"gl_MultiTexCoord0", "isf_vertexTexCoord"},
    {"gl_Color", "isf_vertexColor"},
    {"gl_ModelViewProjectionMatrix", "isf_projection"},
    {"gl_ProjectionMatrix", "isf_projection"},
    {"gl_ModelViewMatrix", "isf_modelView"},
    {"ftransform", "isf_ftransform"},
    {"texture2D", "isf_texture2D"},
    {"texture2DLod", "isf_texture2DLod"},
    {"texture2DLodEXT", "isf_texture2DLod"},
    {"texture2DGradEXT", "textureGrad"},
    {"texture2DProj", "textureProj"},
    {"texture2DRect", "isf_texture2DRect"},
    {"sampler2DRect", "sampler2D"},
    {"pow", "isf_pow"},
    {"attribute", "in"},
};

bool isNameStart(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool isNamePart(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

struct Token {
    enum class Kind { Name, Number, Symbol, Space, Comment } kind;
    std::string text;
};

// One token; comments and white space too, so that the tokens joined are the source.
Token nextToken(const std::string& source, size_t place) {
    auto upTo = [&](Token::Kind kind, size_t end) {
        return Token{kind, source.substr(place, std::min(end, source.size()) - place)};
    };
    const char c = source[place];
    size_t end = place + 1;
    if (source.compare(place, 2, "//") == 0) return upTo(Token::Kind::Comment, source.find('\n', place));
    if (source.compare(place, 2, "/*") == 0) {
        const size_t close = source.find("*/", place + 2);
        return upTo(Token::Kind::Comment, close == std::string::npos ? close : close + 2);
    }
    if (isNameStart(c)) {
        while (end < source.size() && isNamePart(source[end])) end++;
        return upTo(Token::Kind::Name, end);
    }
    if (std::isdigit(static_cast<unsigned char>(c)) ||
        (c == '.' && end < source.size() && std::isdigit(static_cast<unsigned char>(source[end])))) {
        while (end < source.size() &&
               (isNamePart(source[end]) || source[end] == '.' ||
                ((source[end] == '-' || source[end] == '+') && (source[end - 1] | 32) == 'e' && c != '0')))
            end++;
        return upTo(Token::Kind::Number, end);
    }
    if (std::isspace(static_cast<unsigned char>(c))) {
        while (end < source.size() && std::isspace(static_cast<unsigned char>(source[end]))) end++;
        return upTo(Token::Kind::Space, end);
    }
    return upTo(Token::Kind::Symbol, end);
}

std::vector<Token> tokenise(const std::string& source) {
    std::vector<Token> tokens;
    for (size_t place = 0; place < source.size(); place += tokens.back().text.size())
        tokens.push_back(nextToken(source, place));
    return tokens;
}

bool isBlank(const Token& token) {
    return token.kind == Token::Kind::Space || token.kind == Token::Kind::Comment;
}

size_t nextSolid(const std::vector<Token>& tokens, size_t from) {
    while (from < tokens.size() && isBlank(tokens[from])) from++;
    return from;
}

// Everything but line ends goes, so that later lines keep their numbers.
void blank(std::vector<Token>& tokens, size_t from, size_t end) {
    for (size_t k = from; k < end; k++) {
        std::string kept;
        for (char c : tokens[k].text)
            if (c == '\n') kept += c;
        tokens[k] = {Token::Kind::Space, kept.empty() ? " " : kept};
    }
}

// `#version` and `#extension` from their '#' to the end of the line.
void blankDirective(std::vector<Token>& tokens, size_t hash) {
    const size_t name = nextSolid(tokens, hash + 1);
    if (name >= tokens.size() || (tokens[name].text != "version" && tokens[name].text != "extension")) return;
    size_t end = name;
    while (end < tokens.size() && tokens[end].text.find('\n') == std::string::npos) end++;
    blank(tokens, hash, end);
}

bool isStorage(const std::string& word) {
    static const std::set<std::string> words = {"uniform", "varying", "in", "out", "attribute"};
    return words.count(word) > 0;
}

// What looks ahead from a word stops where the next such word stands, or at a semicolon: a file of nothing
// but such words would else take time by the square of its length.

// What stands between a storage word and its semicolon, if it is the declaration of a global variable.
struct Declaration {
    std::vector<std::string> words;  // qualifiers, type, names
    std::string array;
    size_t end = 0;  // the token after the semicolon; 0: no such declaration
};

Declaration declarationAt(const std::vector<Token>& tokens, size_t start) {
    Declaration found;
    for (size_t k = start; k < tokens.size(); k++) {
        const Token& token = tokens[k];
        if (k > start && isStorage(token.text)) {
            return found;  // no declaration holds two
        } else if (token.kind == Token::Kind::Name && found.array.empty()) {
            found.words.push_back(token.text);
        } else if (token.text == ";") {
            if (found.words.size() >= 3) found.end = k + 1;
            return found;
        } else if (token.text == "[" || !found.array.empty()) {
            if (!isBlank(token)) found.array += token.text;
            if (token.text == "," || token.text == "=") return found;
        } else if (!isBlank(token) && token.text != ",") {
            return found;  // a function's parameter
        }
    }
    return found;
}

bool isPrecision(const std::string& word) { return word == "lowp" || word == "mediump" || word == "highp"; }

// Blanks the `layout(...)` that ends before `place`; one declaration holds it.
void blankLayout(std::vector<Token>& tokens, size_t place) {
    size_t k = place;
    while (k > 0 && isBlank(tokens[k - 1])) k--;
    if (k == 0 || tokens[k - 1].text != ")") return;
    while (k > 0 && tokens[k - 1].text != "layout" && tokens[k - 1].text != ";") k--;
    if (k > 0 && tokens[k - 1].text == "layout") blank(tokens, k - 1, place);
}

// Blanks `uniform vec2 RENDERSIZE;` where the host declares that name already; notes what goes between the
// stages, and a fragment shader's own output, which becomes a plain variable.
void readDeclaration(std::vector<Token>& tokens, size_t start, IsfStage stage,
                     const std::set<std::string>& hostNames, IsfUses& uses) {
    const std::string word = tokens[start].text;
    if (!isStorage(word)) return;
    const Declaration declaration = declarationAt(tokens, start);
    if (declaration.end == 0) return;
    const auto& words = declaration.words;
    const size_t type = isPrecision(words[1]) ? 2 : 1;
    const bool isFragment = stage == IsfStage::Fragment;
    if (words.size() == type + 2 && hostNames.count(isfIdentifier(words.back()))) {
        blank(tokens, start, declaration.end);
    } else if (isFragment && word == "out") {
        blankLayout(tokens, start);
        blank(tokens, start, start + 1);
        uses.output = words.back();
    } else if (word == "varying" || word == (isFragment ? "in" : "out")) {
        for (size_t k = type + 1; k < words.size(); k++)
            uses.varyings.push_back({words[type], words[k], k + 1 == words.size() ? declaration.array : ""});
    }
}

// `const float aspect = RENDERSIZE.x / RENDERSIZE.y;` is no constant, though some compilers took it for one.
void blankConst(std::vector<Token>& tokens, size_t start, std::set<std::string>& variables) {
    size_t end = start, assignment = 0;
    bool isVariable = false;
    for (; end < tokens.size() && tokens[end].text != ";"; end++) {
        const std::string& text = tokens[end].text;
        if (text == "{" || (text == ")" && assignment == 0) || (text == "const" && end > start))
            return;  // no declaration
        if (text == "=" && assignment == 0) assignment = end;
        isVariable |= assignment > 0 && variables.count(text) > 0;
    }
    if (!isVariable) return;
    for (size_t k = assignment; k-- > start;)
        if (tokens[k].kind == Token::Kind::Name) {
            variables.insert(tokens[k].text);
            break;
        }
    blank(tokens, start, start + 1);
}

bool isPlainType(const std::string& word) {
    static const std::set<std::string> types = {"float", "int",   "bool",  "vec2",  "vec3",
                                                "vec4",  "ivec2", "ivec3", "ivec4", "bvec2",
                                                "bvec3", "bvec4", "mat2",  "mat3",  "mat4"};
    return types.count(word) > 0;
}

// `vec4 sum;` gets a value where it is declared: published files add to such variables, counting on the zeros
// that they happened to hold where the file was written. Says how far it looked.
size_t initialiseDeclared(std::vector<Token>& tokens, size_t typePlace) {
    size_t k = nextSolid(tokens, typePlace + 1);
    while (k < tokens.size()) {
        if (tokens[k].kind != Token::Kind::Name) return k;  // a constructor, or no declaration
        size_t next = nextSolid(tokens, k + 1);
        if (next >= tokens.size()) return next;
        if (tokens[next].text == "," || tokens[next].text == ";") {
            tokens[k].text += " = " + tokens[typePlace].text + "(0)";
        } else {
            if (tokens[next].text != "=" && tokens[next].text != "[") return next;
            int depth = 0;
            for (; next < tokens.size(); next++) {
                const std::string& text = tokens[next].text;
                if (text == "(" || text == "[" || text == "{") depth++;
                if (text == ")" || text == "]" || text == "}") depth--;
                if (text == ";" || (depth <= 0 && text == ",") || depth < 0) break;
            }
        }
        if (next >= tokens.size() || tokens[next].text != ",") return next;
        k = nextSolid(tokens, next + 1);
    }
    return k;
}

void initialiseLocals(std::vector<Token>& tokens) {
    std::vector<bool> isStruct;  // of the braces around
    bool structAhead = false;
    std::string before;
    size_t looked = 0;
    for (size_t k = 0; k < tokens.size(); k++) {
        if (isBlank(tokens[k])) continue;
        const std::string text = tokens[k].text;
        if (text == "struct") structAhead = true;
        if (text == ";" || text == "(") structAhead = false;
        if (text == "{") {
            isStruct.push_back(structAhead);
            structAhead = false;
        }
        if (text == "}" && !isStruct.empty()) isStruct.pop_back();
        const bool startsStatement =
            before == "{" || before == "}" || before == ";" || isPrecision(before) || before == ":";
        if (!isStruct.empty() && !isStruct.back() && startsStatement && isPlainType(text) && k >= looked)
            looked = initialiseDeclared(tokens, k);
        before = text;
    }
}

}  // namespace

bool isGlslIdentifier(const std::string& name) {
    return !name.empty() && isNameStart(name[0]) && std::all_of(name.begin(), name.end(), isNamePart) &&
           !reserved.count(name) && !interpolation.count(name);
}

std::string isfIdentifier(const std::string& name) {
    std::string identifier;
    for (char c : name) identifier += isNamePart(c) ? c : '_';
    if (!isGlslIdentifier(identifier) || functions.count(identifier)) identifier = "isf_n_" + identifier;
    return identifier;
}

std::string rewriteIsf(const std::string& source, IsfStage stage, const std::set<std::string>& hostNames,
                       IsfUses& uses) {
    std::vector<Token> tokens = tokenise(source);
    for (size_t k = 0; k < tokens.size(); k++) {
        // Drivers differ in what they make of letters that are not ASCII.
        if (tokens[k].kind == Token::Kind::Comment) blank(tokens, k, k + 1);
        if (tokens[k].kind == Token::Kind::Symbol && static_cast<unsigned char>(tokens[k].text[0]) >= 0x80)
            tokens[k] = {Token::Kind::Space, " "};
    }
    std::set<std::string> variables = hostNames;
    variables.insert({"gl_FragCoord", "pow"});
    bool isDirective = false;  // there a name may stand for a function too
    for (size_t k = 0; k < tokens.size(); k++) {
        if (tokens[k].text == "#") {
            isDirective = true;
            blankDirective(tokens, k);
        }
        if (tokens[k].text.find('\n') != std::string::npos) isDirective = false;
        if (tokens[k].kind != Token::Kind::Name) continue;
        std::string& name = tokens[k].text;
        uses.identifiers.insert(name);
        if (name == "discard") uses.discards = true;
        if (name == "gl_FragData") uses.fragmentData = true;
        readDeclaration(tokens, k, stage, hostNames, uses);
        if (name == "const") blankConst(tokens, k, variables);
        if (tokens[k].kind != Token::Kind::Name) continue;
        const size_t next = nextSolid(tokens, k + 1);
        const std::string following = next < tokens.size() ? tokens[next].text : "";
        if (name == "varying") {
            name = stage == IsfStage::Vertex ? "out" : "in";
        } else if (name == "main" && following == "(") {
            name = "isf_main";
            uses.definesMain = true;
        } else if (interpolation.count(name)) {
            if (following != "in" && following != "out" && following != "varying") name = isfIdentifier(name);
        } else if (reserved.count(name) || (functions.count(name) && following != "(" && !isDirective)) {
            name = isfIdentifier(name);
        } else if (auto found = renamed.find(name); found != renamed.end()) {
            name = found->second;
        }
    }
    initialiseLocals(tokens);
    std::string result;
    for (const Token& token : tokens) result += token.text;
    return result;
}

}  // namespace brume
