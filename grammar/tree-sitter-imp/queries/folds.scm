[
  (block)
  (with_expression)
  (arguments)
  (parameters)
  (group)
  (list)
  (comprehension)
] @fold
