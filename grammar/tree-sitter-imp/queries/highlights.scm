; Later patterns go before earlier ones.

(identifier) @variable

; Names with a meaning of their own

((identifier) @constant.builtin
  (#any-of? @constant.builtin "pi" "tau" "phi" "π" "τ" "φ"))

(member_expression member: (identifier) @property)
(binding name: (identifier) @property)
(binding member: (identifier) @property)
(named_argument name: (identifier) @variable.parameter)

; Definitions and calls

(call_expression function: (identifier) @function.call)
(call_expression
  function: (member_expression member: (identifier) @function.method.call))
(binary_expression operator: "|>" right: (identifier) @function.call)

(function_definition name: (identifier) @function)
(field_definition name: (identifier) @function.special)
(param_definition name: (identifier) @variable.special)
(setting_definition name: (identifier) @variable.special)
(import_statement name: (identifier) @module)

(parameters (identifier) @variable.parameter)
(parameters (list_pattern (identifier) @variable.parameter))
(default_parameter pattern: (identifier) @variable.parameter)
(rest_parameter name: (identifier) @variable.parameter)
(lambda parameters: (identifier) @variable.parameter)
(coordinates coordinate: (identifier) @variable.parameter)
(coordinates point: (identifier) @variable.parameter)
(space) @type.builtin

; Literals

(number) @number
(boolean) @boolean
(string) @string
(escape_sequence) @string.escape
(interpolation ["{" "}"] @punctuation.special)
(format) @string.special
(comment) @comment
(doc_comment) @comment.documentation

; Words and signs

["let" "var" "param" "setting" "fn" "field" "test"] @keyword
["import" "as"] @keyword.import
["for" "while" "in"] @keyword.repeat
["if" "then" "else"] @keyword.conditional
["and" "or" "not" "with" "by" "over"] @keyword.operator

["|>" "==" "!=" "<" "<=" ">" ">=" ".." "|" "&" "\\" "+" "-" "*" "/" "%" "@" "^" "!" "=" "->"] @operator

["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," ";" "."] @punctuation.delimiter
