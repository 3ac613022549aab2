; Where names live

[
  (source_file)
  (block)
  (function_definition)
  (field_definition)
  (lambda)
  (for_statement)
  (comprehension)
  (bare_comprehension)
] @local.scope

; Where they are bound

(let_statement pattern: (identifier) @local.definition)
(list_pattern (identifier) @local.definition)
(var_statement name: (identifier) @local.definition)
(param_definition name: (identifier) @local.definition)
(setting_definition name: (identifier) @local.definition)
(import_statement name: (identifier) @local.definition)
(function_definition name: (identifier) @local.definition)
(field_definition name: (identifier) @local.definition)
(parameters (identifier) @local.definition)
(default_parameter pattern: (identifier) @local.definition)
(rest_parameter name: (identifier) @local.definition)
(lambda parameters: (identifier) @local.definition)
(coordinates coordinate: (identifier) @local.definition)
(coordinates point: (identifier) @local.definition)
(for_statement pattern: (identifier) @local.definition)
(for_clause pattern: (identifier) @local.definition)

; Where they are seen

(identifier) @local.reference
