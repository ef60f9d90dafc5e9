"""Tables, and rows to objects of the domain and back."""
