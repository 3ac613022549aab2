(
  (doc_comment)* @doc
  .
  (function_definition name: (identifier) @name) @definition.function
  (#strip! @doc "^##\\s?")
  (#select-adjacent! @doc @definition.function)
)

(
  (doc_comment)* @doc
  .
  (field_definition name: (identifier) @name) @definition.field
  (#strip! @doc "^##\\s?")
  (#select-adjacent! @doc @definition.field)
)

(param_definition name: (identifier) @name) @definition.constant
(setting_definition name: (identifier) @name) @definition.constant
(import_statement name: (identifier) @name) @definition.module

(call_expression function: (identifier) @name) @reference.call
(call_expression
  function: (member_expression member: (identifier) @name)) @reference.call
