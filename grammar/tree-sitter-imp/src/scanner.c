/* What a regular grammar cannot say of Imp's tokens: which line ends end a statement, and the text
 * between the braces and escape sequences of a string.
 *
 * A line end is a token only where the parser can use one, which is never so inside `( )` and `[ ]`
 * or behind an operator, and only if the next line does not begin with what continues a statement:
 * a binary operator other than `-`, `=`, `->`, `|>`, `..`, `.`, or one of the words below. There is
 * no state to keep. */

#include <string.h>

#include "tree_sitter/parser.h"

enum Token { NEWLINE, STRING_CONTENT, ERROR_SENTINEL };

static const char *const CONTINUING_WORDS[] = {"and",  "or",   "then", "else",
                                               "with", "over", "by",   "in"};

enum { LONGEST_WORD = 4 };

void *tree_sitter_imp_external_scanner_create(void) { return NULL; }

void tree_sitter_imp_external_scanner_destroy(void *payload) { (void)payload; }

unsigned tree_sitter_imp_external_scanner_serialize(void *payload, char *buffer) {
  (void)payload;
  (void)buffer;
  return 0;
}

void tree_sitter_imp_external_scanner_deserialize(void *payload, const char *buffer,
                                                  unsigned length) {
  (void)payload;
  (void)buffer;
  (void)length;
}

static bool is_blank(int32_t character) {
  return character == ' ' || character == '\t' || character == '\r' || character == 0xA0 ||
         character == 0xFEFF;
}

/* Whether a character can be part of a name. */
static bool is_word_character(int32_t character) {
  return (character >= 'a' && character <= 'z') || (character >= 'A' && character <= 'Z') ||
         (character >= '0' && character <= '9') || character == '_' ||
         (character >= 0x370 && character <= 0x3FF) ||
         (character >= 0x1F00 && character <= 0x1FFF);
}

/* Goes to the next token, over blanks, line ends and comments. */
static void go_to_next_token(TSLexer *lexer) {
  for (;;) {
    while (is_blank(lexer->lookahead) || lexer->lookahead == '\n') {
      lexer->advance(lexer, false);
    }
    if (lexer->lookahead != '#') {
      return;
    }
    while (lexer->lookahead != '\n' && !lexer->eof(lexer)) {
      lexer->advance(lexer, false);
    }
  }
}

static bool continues_with_word(TSLexer *lexer) {
  char word[LONGEST_WORD + 1] = {0};
  for (unsigned length = 0; is_word_character(lexer->lookahead); length++) {
    if (length == LONGEST_WORD || lexer->lookahead > 'z') {
      return false;
    }
    word[length] = (char)lexer->lookahead;
    lexer->advance(lexer, false);
  }
  for (unsigned i = 0; i < sizeof CONTINUING_WORDS / sizeof CONTINUING_WORDS[0]; i++) {
    if (strcmp(word, CONTINUING_WORDS[i]) == 0) {
      return true;
    }
  }
  return false;
}

/* Whether the token that begins here continues the statement of the line before. */
static bool continues_statement(TSLexer *lexer) {
  switch (lexer->lookahead) {
  case '+':
  case '*':
  case '/':
  case '%':
  case '@':
  case '^':
  case '|':
  case '&':
  case '\\':
  case '=':
  case '<':
  case '>':
  case '.':
    return true;
  case '-':
    lexer->advance(lexer, false);
    return lexer->lookahead == '>';
  case '!':
    lexer->advance(lexer, false);
    return lexer->lookahead == '=';
  default:
    return continues_with_word(lexer);
  }
}

static bool scan_newline(TSLexer *lexer) {
  while (is_blank(lexer->lookahead)) {
    lexer->advance(lexer, true);
  }
  if (lexer->lookahead != '\n') {
    return false;
  }
  lexer->advance(lexer, false);
  lexer->mark_end(lexer);
  lexer->result_symbol = NEWLINE;
  go_to_next_token(lexer);
  return !continues_statement(lexer);
}

static bool scan_string_content(TSLexer *lexer) {
  bool found = false;
  while (!lexer->eof(lexer) && lexer->lookahead != '"' && lexer->lookahead != '\\' &&
         lexer->lookahead != '{' && lexer->lookahead != '}' && lexer->lookahead != '\n') {
    lexer->advance(lexer, false);
    found = true;
  }
  lexer->result_symbol = STRING_CONTENT;
  return found;
}

bool tree_sitter_imp_external_scanner_scan(void *payload, TSLexer *lexer,
                                           const bool *valid_symbols) {
  (void)payload;
  if (valid_symbols[ERROR_SENTINEL]) {
    /* After a mistake everything is tried: a statement may begin on the next line, and a string
     * that was broken off does not go on. */
    return scan_newline(lexer);
  }
  if (valid_symbols[STRING_CONTENT]) {
    return scan_string_content(lexer);
  }
  return valid_symbols[NEWLINE] && scan_newline(lexer);
}
