/**
 * @file The grammar of Imp, a language for implicit geometry.
 * @license MIT OR Apache-2.0
 *
 * It follows `../imp.ebnf`, which says what the rules mean. `src/scanner.c` decides which line ends
 * are tokens and reads the text of strings. Where the language is stricter than is of use to an
 * editor (what may be assigned to, what stands at the top of a file only), this grammar is not.
 */

/// <reference types="tree-sitter-cli/dsl" />
// @ts-check

/** How tight operators bind, from loosest to tightest. */
const LEVEL = {
  open: 0,
  pipe: 1,
  with: 2,
  or: 3,
  and: 4,
  not: 5,
  comparison: 6,
  range: 7,
  union: 8,
  intersection: 9,
  difference: 10,
  sum: 11,
  product: 12,
  sign: 13,
  power: 14,
  postfix: 15,
};

const WORDS = [
  'let', 'var', 'param', 'setting', 'import', 'as', 'test', 'fn', 'field', 'over', 'for', 'in',
  'while', 'if', 'then', 'else', 'and', 'or', 'not', 'with', 'by', 'true', 'false',
];

const GREEK =
  '\\u0370-\\u0374\\u0376-\\u0377\\u037B-\\u037D\\u037F\\u0386\\u0388-\\u038A\\u038C' +
  '\\u038E-\\u03A1\\u03A3-\\u03F5\\u03F7-\\u03FF\\u1F00-\\u1F15\\u1F18-\\u1F1D\\u1F20-\\u1F45' +
  '\\u1F48-\\u1F4D\\u1F50-\\u1F57\\u1F59\\u1F5B\\u1F5D\\u1F5F-\\u1F7D\\u1F80-\\u1FB4' +
  '\\u1FB6-\\u1FBC\\u1FBE\\u1FC2-\\u1FC4\\u1FC6-\\u1FCC\\u1FD0-\\u1FD3\\u1FD6-\\u1FDB' +
  '\\u1FE0-\\u1FEC\\u1FF2-\\u1FF4\\u1FF6-\\u1FFC';

/** `rule`, once or more often with commas between, perhaps with one at the end. */
const listed = (rule) => seq(rule, repeat(seq(',', rule)), optional(','));

export default grammar({
  name: 'imp',

  externals: ($) => [$._newline, $.string_content, $._error_sentinel],

  extras: ($) => [/[ \t\r\n\u00A0\uFEFF]/, $.comment, $.doc_comment],

  word: ($) => $.identifier,

  reserved: {
    global: (_) => WORDS,
  },

  supertypes: ($) => [$.expression, $.statement, $.pattern],

  conflicts: ($) => [
    // `(a, [b]) …` may be the parameters of a function until its `->` comes.
    [$._callable, $.pattern],
    [$._callable, $.rest_parameter],
    [$.list, $.list_pattern],
    // `if a then if b { } else …`: the nearest `if` takes the `else` if it can.
    [$.if_expression],
  ],

  rules: {
    source_file: ($) => optional($._statements),

    _statements: ($) =>
      choice(
        repeat1($._separator),
        seq(
          repeat($._separator),
          $.statement,
          repeat(seq(repeat1($._separator), $.statement)),
          repeat($._separator),
        ),
      ),

    _separator: ($) => choice($._newline, ';'),

    statement: ($) =>
      choice(
        $.param_definition,
        $.setting_definition,
        $.import_statement,
        $.test_definition,
        $.let_statement,
        $.var_statement,
        $.function_definition,
        $.field_definition,
        $.for_statement,
        $.while_statement,
        $.assignment,
        $.expression,
      ),

    param_definition: ($) => seq('param', ...ranged($)),

    setting_definition: ($) => seq('setting', ...ranged($)),

    import_statement: ($) =>
      seq('import', field('path', $.string), 'as', field('name', $.identifier)),

    test_definition: ($) => seq('test', field('name', $.string), field('body', $.block)),

    let_statement: ($) =>
      seq('let', field('pattern', $.pattern), '=', field('value', $.expression)),

    var_statement: ($) =>
      seq('var', field('name', $.identifier), '=', field('value', $.expression)),

    function_definition: ($) =>
      seq(
        'fn',
        field('name', $.identifier),
        field('parameters', $.parameters),
        choice(seq('=', field('body', $.expression)), field('body', $.block)),
      ),

    field_definition: ($) =>
      seq(
        'field',
        field('name', $.identifier),
        field('coordinates', $.coordinates),
        optional(field('domain', $.domain)),
        '=',
        field('body', $.expression),
      ),

    for_statement: ($) =>
      seq(
        'for',
        field('pattern', $.pattern),
        'in',
        field('iterable', $.expression),
        field('body', $.block),
      ),

    while_statement: ($) =>
      seq('while', field('condition', $.expression), field('body', $.block)),

    assignment: ($) =>
      seq(
        field('left', choice($.identifier, $.index_expression, $.member_expression)),
        '=',
        field('right', $.expression),
      ),

    block: ($) => seq('{', optional($._statements), '}'),

    pattern: ($) => choice($.identifier, $.list_pattern),

    list_pattern: ($) => seq('[', optional(listed($.pattern)), ']'),

    parameters: ($) => seq('(', optional(listed($._parameter)), ')'),

    _parameter: ($) => choice($.pattern, $.default_parameter, $.rest_parameter),

    default_parameter: ($) =>
      seq(field('pattern', $.pattern), '=', field('value', $.expression)),

    rest_parameter: ($) => seq(field('name', $.identifier), '..'),

    coordinates: ($) =>
      seq(
        '(',
        choice(
          listed(field('coordinate', $.identifier)),
          seq(field('point', $.identifier), 'in', field('space', $.space)),
        ),
        ')',
      ),

    space: (_) => choice('R1', 'R2', 'R3'),

    domain: ($) => seq('over', $.expression, repeat(seq(',', $.expression))),

    expression: ($) =>
      choice(
        $.number,
        $._callable,
        $.lambda,
        $.conditional_expression,
        $.with_expression,
        $.unary_expression,
        $.binary_expression,
      ),

    lambda: ($) =>
      prec.right(
        LEVEL.open,
        seq(
          field('parameters', choice($.identifier, $.parameters)),
          '->',
          field('body', $.expression),
        ),
      ),

    conditional_expression: ($) =>
      prec.right(
        LEVEL.open,
        seq(
          'if',
          field('condition', $.expression),
          'then',
          field('consequence', $.expression),
          'else',
          field('alternative', $.expression),
        ),
      ),

    with_expression: ($) =>
      prec.left(
        LEVEL.with,
        seq(field('subject', $.expression), 'with', '{', optional($._bindings), '}'),
      ),

    _bindings: ($) =>
      choice(
        repeat1($._comma),
        seq(
          repeat($._comma),
          $.binding,
          repeat(seq(repeat1($._comma), $.binding)),
          repeat($._comma),
        ),
      ),

    _comma: ($) => choice(',', $._separator),

    binding: ($) =>
      seq(
        field('name', $.identifier),
        repeat(seq('.', field('member', $.identifier))),
        '=',
        field('value', $.expression),
      ),

    unary_expression: ($) =>
      choice(
        prec(LEVEL.not, seq(field('operator', 'not'), field('operand', $.expression))),
        prec(LEVEL.sign, seq(field('operator', choice('-', '!')), field('operand', $.expression))),
      ),

    binary_expression: ($) =>
      choice(
        ...[
          ['|>', LEVEL.pipe],
          ['or', LEVEL.or],
          ['and', LEVEL.and],
          ['==', LEVEL.comparison],
          ['!=', LEVEL.comparison],
          ['<', LEVEL.comparison],
          ['<=', LEVEL.comparison],
          ['>', LEVEL.comparison],
          ['>=', LEVEL.comparison],
          ['..', LEVEL.range],
          ['by', LEVEL.range],
          ['|', LEVEL.union],
          ['&', LEVEL.intersection],
          ['\\', LEVEL.difference],
          ['+', LEVEL.sum],
          ['-', LEVEL.sum],
          ['*', LEVEL.product],
          ['/', LEVEL.product],
          ['%', LEVEL.product],
          ['@', LEVEL.product],
        ].map(([operator, level]) => prec.left(level, operation($, operator))),
        prec.right(LEVEL.power, operation($, '^')),
      ),

    /** What may be called: a number may not, so that `2(x)` is no call. */
    _callable: ($) =>
      choice(
        $.identifier,
        $.boolean,
        $.string,
        $.group,
        $.list,
        $.comprehension,
        $.if_expression,
        $.block,
        $.call_expression,
        $.index_expression,
        $.member_expression,
      ),

    call_expression: ($) =>
      prec(
        LEVEL.postfix,
        seq(field('function', $._callable), field('arguments', $.arguments)),
      ),

    index_expression: ($) =>
      prec(
        LEVEL.postfix,
        seq(
          field('subject', choice($.number, $._callable)),
          '[',
          field('index', $.expression),
          ']',
        ),
      ),

    member_expression: ($) =>
      prec(
        LEVEL.postfix,
        seq(
          field('subject', choice($.number, $._callable)),
          '.',
          field('member', $.identifier),
        ),
      ),

    arguments: ($) =>
      seq(
        '(',
        optional(listed(choice($.expression, $.named_argument, $.bare_comprehension))),
        ')',
      ),

    named_argument: ($) =>
      seq(field('name', $.identifier), '=', field('value', $.expression)),

    bare_comprehension: ($) => seq(field('element', $.expression), $._clauses),

    group: ($) => seq('(', $.expression, ')'),

    list: ($) => seq('[', optional(listed($.expression)), ']'),

    comprehension: ($) => seq('[', field('element', $.expression), $._clauses, ']'),

    _clauses: ($) => seq($.for_clause, repeat(choice($.for_clause, $.if_clause))),

    for_clause: ($) =>
      seq('for', field('pattern', $.pattern), 'in', field('iterable', $.expression)),

    if_clause: ($) => seq('if', field('condition', $.expression)),

    if_expression: ($) =>
      seq(
        'if',
        field('condition', $.expression),
        field('consequence', $.block),
        optional(
          seq(
            'else',
            field('alternative', choice($.block, $.if_expression, $.conditional_expression)),
          ),
        ),
      ),

    identifier: (_) =>
      new RegExp('[A-Za-z_' + GREEK + '][A-Za-z0-9_' + GREEK + ']*'),

    boolean: (_) => choice('true', 'false'),

    number: (_) =>
      /[0-9](_?[0-9])*(\.[0-9](_?[0-9])*)?([eE][+-]?[0-9](_?[0-9])*)?(deg|turn)?/,

    string: ($) =>
      seq(
        '"',
        repeat(choice($.string_content, $.escape_sequence, $.interpolation)),
        token.immediate('"'),
      ),

    escape_sequence: (_) =>
      token.immediate(choice('{{', '}}', /\\[ntr"\\]/, /\\u\{[0-9A-Fa-f]+\}/)),

    interpolation: ($) =>
      seq(
        token.immediate('{'),
        field('value', $.expression),
        optional(field('format', $.format)),
        '}',
      ),

    format: (_) => /:\.0*[0-9][0-9]?/,

    doc_comment: (_) => token(prec(1, /##[^\n]*/)),

    comment: (_) => token(/#[^\n]*/),
  },
});

/** `name = value in range`: what a person can change from outside. */
function ranged($) {
  return [
    field('name', $.identifier),
    '=',
    field('value', $.expression),
    optional(seq('in', field('range', $.expression))),
  ];
}

/** Two operands and what stands between them. */
function operation($, operator) {
  return seq(
    field('left', $.expression),
    field('operator', operator),
    field('right', $.expression),
  );
}
